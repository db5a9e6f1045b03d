#include "estimators/identification/recorded_runs.hpp"
#include <gtest/gtest.h>
#include <cstdio>
#include "io/csv.hpp"
namespace slipstream { namespace {
void show(const char* n, const Interval& i) { std::printf("  %s %.5g +- %.2g\n", n, i.value, i.half_width); }
TEST(Recorded, DISABLED_Figures) {
  const std::string data = SLIPSTREAM_DATA_DIR;
  const CsvTable sweep = read_csv(data + "/qcar_speed/stand_sweep.csv", {"cmd_pwm", "v_mean_mps"});
  const SteadyLine line = identify_steady_line(sweep["cmd_pwm"], sweep["v_mean_mps"]);
  std::printf("stand R2 %.5f it %d\n", line.r2, line.iterations); show("K", line.gain); show("u0", line.dead_band); show("vmax", line.limit);
  const CsvTable g = read_csv(data + "/qcar_speed/ground_runs.csv", {"t_s", "cmd_pwm", "v_enc_mps"}, "t_s");
  for (int only_moving : {0, 1}) {
    auto runs = split_into_runs(g["t_s"], g["cmd_pwm"], g["v_enc_mps"], 0.5);
    if (only_moving) std::erase_if(runs, [](const DriveRun& r) { return r.input.back() < 0.0375; });
    const FirstOrder f = identify_first_order(runs);
    std::printf("ground %zu runs %zu samples R2 %.5f it %d\n", runs.size(), f.measured.size(), f.r2, f.iterations); show("tau", f.time_constant_s); show("K", f.gain); show("u0", f.dead_band);
  }
  const CsvTable m = read_csv(data + "/f1tenth_friction/ds5a/motor.csv", {"t_s", "i_motor_A", "erpm_fwd"}, "t_s");
  std::vector<double> w; for (double e : m["erpm_fwd"]) w.push_back(e * 0.00264063623);
  for (double minw : {3.0, 6.0, 10.0, 20.0}) {
    const auto runs = split_into_runs(m["t_s"], m["i_motor_A"], w, 0.3, minw);
    const RollingDrive r = identify_rolling_drive(runs, 0.0027 * 11.85);
    std::printf("ds5a min %g: %zu runs %zu samples R2 %.4f it %d\n", minw, runs.size(), r.measured.size(), r.r2, r.iterations); show("J", r.inertia_kgm2); show("b", r.friction_nms); show("c", r.friction_torque_nm);
  }
}
} }
