// Section 5.1: moment of inertia and friction of a suspended wheel by particle swarm (Figs 16 and 17, Tables 5 and 6), and what
// recorded drives let one identify.
#include "estimators/identification/stand.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "estimators/identification/recorded_runs.hpp"
#include "models/vehicles/suspended_wheel.hpp"
#include "models/vehicles/torque_car.hpp"
#include "reproduce/monte_carlo.hpp"

namespace slipstream {
namespace {

constexpr double kInertia = 3.2e-3, kFriction = 0.01;  // Table 5; the simulated truth
constexpr double kResidual_a = 0.4;                    // ours: what the current sensor shows at rest

StandRecord record_of(const Bench& bench, int seed) {
  const Played p =
      play(bench.scenario("stand", {seed_is(seed), fmt::format("sensor.motor_current.bias_a={}", kResidual_a)}), {});
  StandRecord r;
  const Series& w = p.measured.at("wheel_speed_radps");
  for (const double t : w.t_s) r.utime.push_back(utime_of(t));
  r.wheel_speed_radps = w.value;
  r.current_a = p.measured.at("motor_current_a").value;
  return r;
}

std::string text(const Interval& i, double scale, int digits) {
  return fmt::format("{:.{}f} ± {:.{}f}", scale * i.value, digits, scale * i.half_width, digits);
}

void synthetic(const Bench& bench, Outcome& o) {
  StandSettings settings;
  const StandResult first = identify_stand(record_of(bench, 1), settings);
  const double end_s = first.time_s.back();
  o.figures.push_back(
      Sketch("Fig. 16", "Filtered motor current", end_s)
          .panel("current (A)", 340)
          .line("measured", first.time_s, first.raw_current_a, kMeasuredStyle)
          .line("filtered, without delay and residual current", first.time_s, first.filtered_current_a, line_of(0))
          .finish("First-order Butterworth low-pass at 25 Hz, forwards and backwards so that it has no delay; the residual "
                  "current is what the sensor shows while the wheel stands still. The profile is ours."));
  o.figures.push_back(Sketch("Fig. 17", "Wheel speed with the identified parameters", end_s)
                          .panel("wheel speed (rad/s)", 340)
                          .line("measured", first.time_s, first.measured_radps, kMeasuredStyle)
                          .line("simulated by Runge-Kutta", first.time_s, first.fits[0].simulated_radps, line_of(0))
                          .finish("Simulated from the filtered current alone. Seed 1."));

  int covered[2][2] = {{0, 0}, {0, 0}};
  const int repetitions = 5 * bench.seeds;
  std::vector<std::vector<double>> columns(8);
  for (int seed = 1; seed <= repetitions; ++seed) {
    bench.progress(seed - 1, repetitions);
    const StandResult r = identify_stand(record_of(bench, seed), settings);
    for (std::size_t k = 0; k < 2; ++k) {
      const StandFit& f = r.fits[k];
      covered[k][0] += f.inertia_kgm2.contains(kInertia) ? 1 : 0;
      covered[k][1] += f.friction_nms.contains(kFriction) ? 1 : 0;
      if (seed > bench.seeds) continue;
      columns[4 * k + 0].push_back(f.iterations);
      columns[4 * k + 1].push_back(1e3 * f.inertia_kgm2.value);
      columns[4 * k + 2].push_back(1e3 * f.friction_nms.value);
      columns[4 * k + 3].push_back(f.r2);
    }
  }
  bench.progress(repetitions, repetitions);

  struct Printed6 {
    const char *cost, *iterations, *inertia, *friction, *r2;
  };
  constexpr Printed6 kTable6[] = {{"RK", "34", "3.167", "10.29", "0.98892"}, {"LSIM", "38", "3.173", "10.28", "0.98891"}};
  Table table{"Both cost functions; in brackets the document's; seed 1 with its 95 % interval",
              {{"cost function", false}, {"iterations"}, {"J (1e-3 kg m²)"}, {"b (1e-3 N m s)"}, {"R2"}},
              {}};
  for (std::size_t k = 0; k < 2; ++k) {
    const Printed6& p = kTable6[k];
    const StandFit& f = first.fits[k];
    table.rows.push_back({p.cost, fmt::format("{} ({})", f.iterations, p.iterations),
                          fmt::format("{} ({})", text(f.inertia_kgm2, 1e3, 4), p.inertia),
                          fmt::format("{} ({})", text(f.friction_nms, 1e3, 3), p.friction),
                          fmt::format("{:.5f} ({})", f.r2, p.r2)});
    o.rows.push_back(judged("Table 6", fmt::format("R2, {}", p.cost), "", Printed(p.r2), Aim::kHigh, columns[4 * k + 3],
                            "the noise of the speed is ours", "decided by the noise that we give the speed sensor"));
    o.rows.push_back(judged("Table 6", fmt::format("iterations, {}", p.cost), "", Printed(p.iterations), Aim::kLow,
                            columns[4 * k],
                            "the rule by which the swarm stops is stricter: no gain above 1e-6 over 20 iterations"));
    o.rows.push_back(reported("Table 6", fmt::format("J, {}", p.cost), "1e-3 kg m²", columns[4 * k + 1],
                              fmt::format("the truth is 3.2; the document found {} on its own car", p.inertia)));
    o.rows.push_back(reported("Table 6", fmt::format("b, {}", p.cost), "1e-3 N m s", columns[4 * k + 2],
                              fmt::format("the truth is 10; the document found {} on its own car", p.friction)));
    for (const std::size_t i : {0U, 1U})
      o.rows.push_back(reported("Table 6", fmt::format("true {} inside its 95 % interval, {}", i == 0 ? "J" : "b", p.cost), "%",
                                {100.0 * covered[k][i] / repetitions}, fmt::format("of {} repetitions", repetitions)));
  }
  o.tables.push_back(
      {"Table 6",
       "Intervals from the curvature of the cost, with the correlation of neighbouring residuals and the uncertainty of the "
       "residual current. Current and speed determine J / k_m and b / k_m only: both are as right as k_m is.",
       table});
  const SuspendedWheel wheel = std::get<SuspendedWheel>(bench.scenario("stand", {}).plant.vehicle);
  const TorqueCar car = std::get<TorqueCar>(bench.scenario("scale_car", {}).plant.vehicle);
  add_parameters(o, "Table 5", "Parameters of the scale car", "On the stand and on the ground.",
                 {{"mass (a quarter)", "0.7", car.quarter.mass_kg, "kg"},
                  {"gravity", "9.81", kGravity_mps2, "m/s²"},
                  {"wheel inertia J, on the stand", "3.2e-3", wheel.wheel_inertia_kgm2, "kg m²"},
                  {"wheel inertia J, on the ground", "3.2e-3", car.quarter.wheel_inertia_kgm2, "kg m²"},
                  {"wheel radius", "0.033", car.quarter.wheel_radius_m, "m"},
                  {"viscous friction b, on the stand", "0.01", wheel.viscous_friction_nms, "N m s"},
                  {"viscous friction b, on the ground", "0.01", car.quarter.viscous_friction_nms, "N m s"}});
}

void qcar(const Bench& bench, Outcome& o) {
  const auto stand = bench.columns("qcar_speed/stand_sweep.csv", {"cmd_pwm", "v_mean_mps"});
  const SteadyLine line = identify_steady_line(stand[0], stand[1]);
  o.figures.push_back(
      Sketch("Stand QCar", "A real QCar on its stand: steady speed over the motor command", "motor command (-)",
             range_of({stand[0]}))
          .panel("speed (m/s)", 320)
          .line("measured", stand[0], stand[1], "with points pt 7 ps 0.7 lc rgb \"#555555\"")
          .line("fit", stand[0], line.simulated, line_of(0))
          .finish("qcar_speed/stand_sweep.csv. Straight above a dead band, then flat: a limit of the logger or the driver."));
  const auto floor = bench.columns("qcar_speed/ground_runs.csv", {"t_s", "cmd_pwm", "v_enc_mps"});
  const FirstOrder f = identify_first_order(split_into_runs(floor[0], floor[1], floor[2], 0.5));
  const std::string none = "no current was recorded: J and b themselves cannot be known, only these";
  const auto interval = [&](const std::string& what, const std::string& unit, const Interval& i, const std::string& note) {
    o.rows.push_back(reported("Stand QCar", what, unit, {i.value}, fmt::format("± {:.2g} (95 %); {}", i.half_width, note)));
  };
  interval("gain on the stand", "m/s per unit of command", line.gain, none);
  interval("dead band on the stand", "-", line.dead_band, none);
  interval("gain on the floor", "m/s per unit of command", f.gain, none);
  interval("time constant on the floor, J/b", "s", f.time_constant_s, none);
  o.rows.push_back(reported("Stand QCar", "R2 of the steady line on the stand", "", {line.r2}));
  o.rows.push_back(reported("Stand QCar", "R2 of the first-order response on the floor", "", {f.r2}));
}

void f1tenth(const Bench& bench, Outcome& o) {
  const auto c = bench.columns("f1tenth_friction/ds5a/motor.csv", {"t_s", "i_motor_A", "erpm_fwd"});
  const double radius_m = 0.319 / (2.0 * kPi);  // the data's README: tyre circumference, speed = erpm / 7459
  std::vector<double> w;
  for (const double erpm : c[2]) w.push_back(erpm / 7459.0 / radius_m);
  const RollingDrive r = identify_rolling_drive(split_into_runs(c[0], c[1], w, 0.3, 10.0), 0.0027 * 11.85);
  const auto interval = [&](const std::string& what, const std::string& unit, const Interval& i, const std::string& note) {
    o.rows.push_back(reported("Floor F1TENTH", what, unit, {i.value}, fmt::format("± {:.2g} (95 %); {}", i.half_width, note)));
  };
  interval("inertia at the wheel", "kg m²", r.inertia_kgm2,
           "the car's mass alone is m r² = 8.6e-3 kg m²; k_m = 0.0027 N m/A times the gear of 11.85 is taken for known");
  interval("viscous friction", "N m s", r.friction_nms, "all four wheels together");
  interval("constant friction", "N m", r.friction_torque_nm, "gearbox and rolling losses");
  o.rows.push_back(
      reported("Floor F1TENTH", "R2 of the wheel speed", "", {r.r2}, "the current is sampled at 18 Hz and changes faster"));
}

}  // namespace

void reproduce_stand(const Bench& bench, Outcome& o) {
  synthetic(bench, o);
  if (bench.data_dir.empty()) {
    o.notes.emplace_back("Recorded drives are not here: the identification from qcar_speed and f1tenth_friction is left out.");
    return;
  }
  qcar(bench, o);
  f1tenth(bench, o);
}

}  // namespace slipstream
