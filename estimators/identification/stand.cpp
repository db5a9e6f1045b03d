#include "estimators/identification/stand.hpp"

#include <fmt/format.h>

#include <cmath>

#include "common/refusal.hpp"
#include "estimators/identification/low_pass.hpp"

namespace slipstream {
namespace {

constexpr std::size_t kFewestAtStandstill = 20;
// Residuals are correlated as long as the wheel remembers its noise, J / b; a lag of this many J / b sees 7/8 of that.
constexpr double kLagInTimeConstants = 8.0;

struct Mean {
  double value = 0.0;
  double variance = 0.0;  // of the mean, neighbours counted as correlated over n^(1/3) samples
};
Mean mean_of(std::span<const double> x) {
  const auto n = static_cast<Eigen::Index>(x.size());
  const Eigen::Map<const Eigen::VectorXd> values(x.data(), n);
  const double mean = values.mean();
  const int lag = static_cast<int>(std::ceil(std::cbrt(static_cast<double>(n))));
  const double sum = bartlett_covariance(values.array() - mean, lag)(0, 0);
  return {mean, sum / static_cast<double>(n * (n - 1))};
}

std::size_t standstill_samples(const StandRecord& r, const StandSettings& s) {
  const std::size_t n = r.utime.size();
  if (r.current_a.size() != n || r.wheel_speed_radps.size() != n)
    throw Refusal(fmt::format("stand: {} times, {} currents and {} wheel speeds, expected as many of each", n,
                              r.current_a.size(), r.wheel_speed_radps.size()));
  if (n < 2) throw Refusal(fmt::format("stand: {} samples, expected at least 2", n));
  const Utime period = r.utime[1] - r.utime[0];
  for (std::size_t k = 1; k < n; ++k)
    if (r.utime[k] - r.utime[k - 1] != period || period <= 0)
      throw Refusal(fmt::format("stand: sample {} comes {} us after the one before, expected {} us like the first two", k,
                                r.utime[k] - r.utime[k - 1], period));
  if (!(s.cutoff_hz > 0.0 && s.cutoff_hz < 0.5 / seconds(period)))
    throw Refusal(fmt::format("stand: cutoff {:g} Hz, expected more than 0 and less than half the sample rate, {:g} Hz",
                              s.cutoff_hz, 0.5 / seconds(period)));
  std::size_t still = 0;
  while (still < n && seconds(r.utime[still] - r.utime[0]) < s.standstill_s) ++still;
  if (still < kFewestAtStandstill || still == n)
    throw Refusal(fmt::format("stand: {} of {} samples within the standstill of {:g} s, expected at least {} and not all",
                              still, n, s.standstill_s, kFewestAtStandstill));
  const Mean speed = mean_of(std::span(r.wheel_speed_radps).first(still));
  if (std::abs(speed.value) > 5.0 * std::sqrt(speed.variance))  // five standard errors: once in two million records at rest
    throw Refusal(fmt::format("stand: the wheel turns at {:.3g} rad/s within the first {:g} s, expected standstill",
                              speed.value, s.standstill_s));
  return still;
}

}  // namespace

StandResult identify_stand(const StandRecord& record, const StandSettings& s, const std::vector<Method>& methods) {
  const std::size_t still = standstill_samples(record, s);
  const double period_s = seconds(record.utime[1] - record.utime[0]);
  const Mean residual = mean_of(std::span(record.current_a).first(still));

  StandResult result;
  for (const Utime t : record.utime) result.time_s.push_back(seconds(t));
  result.raw_current_a = record.current_a;
  result.residual_current_a = {residual.value, 1.96 * std::sqrt(residual.variance)};
  result.measured_radps = record.wheel_speed_radps;
  result.filtered_current_a = ButterworthLowPass(s.cutoff_hz, 1.0 / period_s).without_delay(record.current_a);
  for (double& i : result.filtered_current_a) i -= residual.value;

  std::vector<double> torque_nm;
  for (const double i : result.filtered_current_a) torque_nm.push_back(s.torque_constant_nmpa * i);
  for (const Method method : methods) {
    const auto response = [&](const std::vector<double>& torque, const std::vector<double>& theta, std::vector<double>& y) {
      wheel_response(method, Hold::kLinear, {theta[0], theta[1]}, record.utime, torque, 0.0, y);
    };
    FitProblem problem;
    problem.response = [&](const std::vector<double>& theta, std::vector<double>& y) { response(torque_nm, theta, y); };
    problem.measured = record.wheel_speed_radps;
    problem.names = {"J", "b"};
    problem.lower = {s.min_inertia_kgm2, s.min_friction_nms};
    problem.upper = {s.max_inertia_kgm2, s.max_friction_nms};
    problem.lag = [&](const std::vector<double>& theta) {
      return static_cast<int>(std::ceil(kLagInTimeConstants * theta[0] / theta[1] / period_s));
    };
    // The response is linear in the torque: a residual current too large by 1 A takes this away.
    problem.known_beforehand = [&](const std::vector<double>& theta) {
      KnownBeforehand offset;
      response(std::vector<double>(torque_nm.size(), -s.torque_constant_nmpa), theta, offset.derivative);
      offset.variance = residual.variance;
      return std::vector<KnownBeforehand>{offset};
    };
    ResponseFit fit = fit_response(problem, s.swarm);
    result.fits.push_back({method == Method::kRungeKutta ? "RK" : "LSIM", fit.iterations, fit.converged, fit.parameters[0],
                           fit.parameters[1], fit.r2, std::move(fit.simulated)});
  }
  return result;
}

}  // namespace slipstream
