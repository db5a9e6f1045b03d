// Chapter 7, the model: engine, gears and wheel torque of the Unimog (Figs 37-40, Tables 13-15).
#include <fmt/format.h>

#include <algorithm>

#include "plant/vehicle_simulation.hpp"
#include "reproduce/monte_carlo.hpp"

namespace slipstream {
namespace {

constexpr const char* kReconstructed =
    "the document prints neither engine points nor start gear and throttle; ours were searched (models/vehicles/unimog.hpp)";
constexpr const char* kReadOff =
    "the tolerance is what a curve can be read to; the engine points that give torque and peak at once shift some 15 ms early";

void engine(const Unimog& u, Outcome& o) {
  std::vector<double> rpm, quintic, quadratic;
  const EngineCurve jazar = quadratic_curve(u.rated_power_w, u.rated_speed_rpm * kRadpsPerRpm);
  for (double n = 800.0; n <= 2200.0; n += 10.0) {
    rpm.push_back(n);
    quintic.push_back(u.curve().torque_nm(n * kRadpsPerRpm));
    quadratic.push_back(jazar.torque_nm(n * kRadpsPerRpm));
  }
  o.figures.push_back(Sketch("Fig. 37", "Torque of the engine OM 924 LA", "engine speed (rpm)", {800.0, 2250.0})
                          .panel("torque (N m)", 380)
                          .line("quadratic, eqs 7.1 and 7.2", rpm, quadratic, line_of(0))
                          .line("quintic", rpm, quintic, line_of(1))
                          .line("points", u.engine_speed_rpm, u.engine_torque_nm, "with points pt 7 ps 1.1 lc rgb \"#000000\"")
                          .finish("Both curves give 160 kW at 2200 rpm; only the quintic has the plateau that the peak of "
                                  "Fig. 40 needs. The points are a reconstruction."));
  o.rows.push_back(met("Fig. 37", "engine power at 2200 rpm, quadratic", "kW", Printed("160"),
                       quadratic.back() * 2200.0 * kRadpsPerRpm * 1e-3, 0.0, ""));
  o.rows.push_back(met("Fig. 37", "engine power at 2200 rpm, quintic", "kW", Printed("160"),
                       quintic.back() * 2200.0 * kRadpsPerRpm * 1e-3, 0.0,
                       "a least-squares quintic does not pass through its last point", kReconstructed));
}

// Eight gears, two more than there are estimator styles.
std::string line_of_gear(std::size_t k) {
  return k < 6 ? line_of(k) : fmt::format("with lines lc rgb \"{}\" lw 2 dt 1", k == 6 ? "#000000" : "#999999");
}

void gears(const Unimog& u, Outcome& o) {
  static constexpr const char* kSpeeds_kmph[] = {"6.5", "9.4", "14.2", "19.3", "28.4", "41", "62.1", "84.4"};
  Sketch speeds("Fig. 38", "Speed in each gear", "engine speed (rpm)", {800.0, 2250.0});
  Sketch torques("Fig. 39", "Wheel torque in each gear", "speed (km/h)", {0.0, 90.0});
  speeds.panel("speed (km/h)", 380);
  torques.panel("torque at all wheels (kN m)", 380);
  static constexpr const char* kRatios[] = {"9.57", "6.635", "4.375", "3.219", "2.188", "1.517", "1.000", "0.736"};
  std::vector<Parameter> ratios;
  Table top{"Speed at 2200 rpm", {{"gear", false}, {"published (km/h)"}, {"ours (km/h)"}}, {}};
  for (int gear = 1; gear <= u.driveline.gears(); ++gear) {
    std::vector<double> rpm, kmph, torque;
    for (double n = 800.0; n <= 2200.0; n += 20.0) {
      rpm.push_back(n);
      kmph.push_back(3.6 * u.driveline.speed_mps(n * kRadpsPerRpm, gear, u.quarter.wheel_radius_m));
      torque.push_back(1e-3 * u.driveline.wheel_torque_nm(u.curve().torque_nm(n * kRadpsPerRpm), gear));
    }
    const auto k = static_cast<std::size_t>(gear - 1);
    speeds.line(fmt::format("{}", gear), rpm, kmph, line_of_gear(k));
    torques.line(fmt::format("{}", gear), kmph, torque, line_of_gear(k));
    ratios.push_back({fmt::format("gear {}", gear), kRatios[k], u.driveline.gear_ratio[k], ""});
    top.rows.push_back({fmt::format("{}", gear), kSpeeds_kmph[k], fmt::format("{:.1f}", kmph.back())});
    o.rows.push_back(
        met("Table 14", fmt::format("speed in gear {}", gear), "km/h", Printed(kSpeeds_kmph[k]), kmph.back(), 0.0, ""));
  }
  ratios.push_back({"final drive", "6.94", u.driveline.final_drive, ""});
  o.figures.push_back(speeds.finish("Eq. 7.8 with an effective radius of 0.52 m."));
  o.figures.push_back(torques.finish("Eq. 7.10 with an efficiency of 0.9, from idle to rated speed, at full throttle."));
  add_parameters(o, "Table 13", "Gear ratios", "", ratios);
  o.tables.push_back({"Table 14", "", top});
}

}  // namespace

void reproduce_drivetrain(const Bench& bench, Outcome& o) {
  bench.progress(0, 2);
  const Scenario scenario = bench.scenario("unimog", {});
  Unimog u = std::get<Unimog>(scenario.plant.vehicle);
  u.prepare();
  engine(u, o);
  gears(u, o);
  bench.progress(1, 2);

  VehicleSimulation<Unimog> run(u, {scenario.plant.relative_tolerance, scenario.plant.absolute_tolerance});
  std::vector<double> t_s, torque;
  for (int k = 0; k <= 1000; ++k) {
    t_s.push_back(0.01 * k);
    run.advance(t_s.back());
    torque.push_back(run.vehicle().inputs(run.state(), run.mode())[0]);
  }
  std::vector<double> upshifts;
  for (const ModeChange& c : run.changes())
    if (c.event == 0) upshifts.push_back(c.time_s);
  o.figures.push_back(Sketch("Fig. 40", "Wheel torque", 10.0, upshifts)
                          .panel("torque (N m)", 380)
                          .line("torque at one wheel", t_s, torque, line_of(0))
                          .finish("One wheel, 40 % throttle, from third gear; dotted lines: upshifts at 2200 rpm."));
  o.rows.push_back(met("Fig. 40", "torque at first", "N m", Printed("1400"), torque.front(), 30.0, "", kReadOff));
  o.rows.push_back(met("Fig. 40", "largest torque", "N m", Printed("2218"), *std::max_element(torque.begin(), torque.end()),
                       20.0, "", kReconstructed));
  const char* const kDrops_s[] = {"2.56", "3.73", "7.1"};
  for (std::size_t i = 0; i < 3; ++i)
    o.rows.push_back(met("Fig. 40", fmt::format("drop {}", i + 1), "s", Printed(kDrops_s[i]),
                         i < upshifts.size() ? upshifts[i] : std::nan(""), 0.06, "", kReadOff));
  const QuarterCar& q = u.quarter;
  add_parameters(o, "Table 15", "Parameters of the Unimog", "The mass is a quarter of the vehicle's.",
                 {{"mass", "2000", q.mass_kg, "kg"},
                  {"wheel radius", "0.52", q.wheel_radius_m, "m"},
                  {"wheel inertia", "11.5", q.wheel_inertia_kgm2, "kg m²"},
                  {"gravity", "9.81", kGravity_mps2, "m/s²"},
                  {"rolling resistance", "0.02", q.rolling_resistance, ""},
                  {"air density", "1.2", q.air_density_kgpm3, "kg/m³"},
                  {"frontal area", "5.6", q.frontal_area_m2, "m²"},
                  {"drag coefficient", "0.6", q.drag_coefficient, ""}});
  bench.progress(2, 2);
}

}  // namespace slipstream
