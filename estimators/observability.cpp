#include "estimators/observability.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "estimators/kalman.hpp"

namespace slipstream {

namespace {

constexpr double kRankTolerance = 1e-10;
constexpr double kPartOfNullSpace = 1e-6;
constexpr double kMuchLeft = 0.5;
constexpr double kFades = 0.99;

template <ProcessModel M>
struct Trajectory {
  std::vector<Vector<double, M::kStates>> x;
  std::vector<Vector<double, M::kInputs>> u;  // from x[k] to x[k + 1]
  double dt_s = 0.0;
  std::vector<std::uint32_t> measured;  // bits of the outputs measured at x[k]
};

// The outputs that a sensor measures, and each one's rate (0: none).
template <ProcessModel M>
std::array<double, M::kOutputNames.size()> rates_of(const Scenario& scenario) {
  std::array<double, M::kOutputNames.size()> rates{};
  for (const SensorConfig& s : scenario.sensors)
    for (std::size_t i = 0; i < rates.size(); ++i)
      if (s.quantity == M::kOutputNames[i].name) rates[i] = std::max(rates[i], s.rate_hz);
  return rates;
}

// From x without input, as long as it stays finite.
template <ProcessModel M>
Trajectory<M> roll_out(const M& model, Vector<double, M::kStates> x, const Scenario& scenario) {
  const auto rates = rates_of<M>(scenario);
  const double fastest = *std::max_element(rates.begin(), rates.end());
  Trajectory<M> t;
  if (fastest <= 0.0) return t;
  t.dt_s = 1.0 / fastest;
  const int steps = static_cast<int>(std::ceil(kObservabilityWindow_s * fastest));
  const Vector<double, M::kInputs> u = Vector<double, M::kInputs>::Zero();
  for (int k = 0; k <= steps && x.allFinite(); ++k) {
    std::uint32_t measured = 0;
    for (std::size_t i = 0; i < rates.size(); ++i)
      if (rates[i] > 0.0 && k % std::max(1, static_cast<int>(std::min(1e9, std::round(fastest / rates[i])))) == 0)
        measured |= 1U << i;
    t.x.push_back(x);
    t.u.push_back(u);
    t.measured.push_back(measured);
    x = transition(model, x, u, t.dt_s);
  }
  return t;
}

template <ProcessModel M>
Observability along(const Belief<M>& belief, const Scenario& scenario, const Trajectory<M>& t) {
  constexpr int n = M::kStates;
  using Square = Matrix<double, n>;
  Observability o;
  o.model = M::kName;
  const auto rates = rates_of<M>(scenario);
  for (std::size_t i = 0; i < rates.size(); ++i)
    if (rates[i] > 0.0) o.outputs.emplace_back(M::kOutputNames[i].name);
  const Vector<double, n> sigma = belief.initial_variance.cwiseSqrt();
  for (int i = 0; i < n; ++i) {
    o.states.push_back({std::string(M::kStateNames[static_cast<std::size_t>(i)].name)});
    if (!(sigma[i] > 0.0))
      throw Refusal(fmt::format("tuning: initial_variance.{} is {}, expected a number greater than 0 to measure observability",
                                o.states.back().name, belief.initial_variance[i]));
  }

  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(t.x.size()) * M::kOutputs, n);
  Square carried = sigma.asDiagonal();  // Phi_k P_0^1/2
  std::size_t used = 0;
  for (; used < t.x.size(); ++used) {
    Vector<double, M::kOutputs> z;
    Matrix<double, M::kOutputs, n> h;
    value_and_jacobian<M::kOutputs>([&](const auto& x) { return belief.model.output(x, t.u[used]); }, t.x[used], z, h);
    const Matrix<double, M::kOutputs, n> slope = h * carried;
    if (!slope.allFinite() || !z.allFinite()) break;
    for (int i = 0; i < M::kOutputs; ++i) {
      if ((t.measured[used] >> i & 1U) == 0U) continue;
      const double variance = belief.noise[static_cast<std::size_t>(i)].variance(z[i], slope.row(i).squaredNorm());
      if (variance > 0.0) rows.row(static_cast<Eigen::Index>(used) * M::kOutputs + i) = slope.row(i) / std::sqrt(variance);
    }
    if (used + 1 == t.x.size()) break;
    Vector<double, n> unused;
    Square f;
    transition_and_jacobian(belief.model, t.x[used], t.u[used], t.dt_s, unused, f);
    carried = (f * carried).eval();
  }
  o.window_s = t.dt_s * static_cast<double>(used);

  Eigen::MatrixXd square = Eigen::MatrixXd::Zero(std::max<Eigen::Index>(rows.rows(), n), n);  // at least n rows: n values
  square.topRows(rows.rows()) = rows;
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(square, Eigen::ComputeThinV);
  const Vector<double, n> s = svd.singularValues();
  const Square v = svd.matrixV();
  o.singular_values.assign(s.data(), s.data() + n);
  for (int i = 0; i < n; ++i) o.rank += s[i] > 0.0 && s[i] > kRankTolerance * s[0] ? 1 : 0;
  o.gramian_condition = o.observable() ? std::pow(s[0] / s[n - 1], 2) : std::numeric_limits<double>::infinity();
  const Vector<double, n> left = (1.0 + s.array().square()).inverse();
  for (int i = 0; i < n; ++i) {
    Observability::State& state = o.states[static_cast<std::size_t>(i)];
    state.variance_ratio = v.row(i).cwiseAbs2() * left;
    state.unobservable = v.row(i).tail(n - o.rank).norm() > kPartOfNullSpace;
    state.weak = !state.unobservable && state.variance_ratio > kMuchLeft;
  }
  if (!o.observable()) {
    const Eigen::MatrixXd null_space = sigma.cwiseInverse().asDiagonal() * carried * v.rightCols(n - o.rank);
    o.fading = null_space.operatorNorm() < kFades;
  }
  return o;
}

const AnyProcess& process_of(const Scenario& scenario, const Tuning& tuning) {
  return tuning.process ? *tuning.process : scenario.estimator.process;
}

std::vector<std::string> names_where(const Observability& o, bool Observability::State::*flag) {
  std::vector<std::string> names;
  for (const Observability::State& s : o.states)
    if (s.*flag) names.push_back(s.name);
  return names;
}

// "a", "a and b", "a, b and c"
std::string listed(std::vector<std::string> names) {
  if (names.size() < 2) return names.empty() ? "" : names[0];
  const std::string last = names.back();
  names.pop_back();
  return fmt::format("{} and {}", fmt::join(names, ", "), last);
}

}  // namespace

Eigen::MatrixXd observability_matrix(const Eigen::MatrixXd& a, const Eigen::MatrixXd& c) {
  Eigen::MatrixXd o(a.rows() * c.rows(), a.cols());
  Eigen::MatrixXd block = c;
  for (Eigen::Index k = 0; k < a.rows(); ++k) {
    o.middleRows(k * c.rows(), c.rows()) = block;
    block = (block * a).eval();
  }
  return o;
}

int numerical_rank(const Eigen::MatrixXd& matrix) {
  Eigen::JacobiSVD<Eigen::MatrixXd> svd(matrix);
  svd.setThreshold(kRankTolerance);
  return static_cast<int>(svd.rank());
}

std::vector<std::string> Observability::unobservable() const { return names_where(*this, &State::unobservable); }
std::vector<std::string> Observability::weak() const { return names_where(*this, &State::weak); }

Observability observability_of(const Scenario& scenario, const Tuning& tuning) {
  return std::visit(
      [&]<typename M>(const M& model) {
        const Belief<M> belief = make_belief(model, scenario, tuning);
        const Observability at_start = along(belief, scenario, roll_out(model, belief.initial_mean, scenario));
        if (at_start.observable()) return at_start;
        const Vector<double, M::kStates> beside = belief.initial_mean + belief.initial_variance.cwiseSqrt();
        const Observability moved = along(belief, scenario, roll_out(model, beside, scenario));
        return moved.rank > at_start.rank ? moved : at_start;
      },
      process_of(scenario, tuning));
}

Observability observability_along(const Scenario& scenario, const Tuning& tuning,
                                  const std::vector<std::vector<double>>& states,
                                  const std::vector<std::vector<double>>& inputs, double dt_s) {
  return std::visit(
      [&]<typename M>(const M& model) {
        const auto rates = rates_of<M>(scenario);
        Trajectory<M> t;
        t.dt_s = dt_s;
        std::uint32_t measured = 0;
        for (std::size_t i = 0; i < rates.size(); ++i) measured |= rates[i] > 0.0 ? 1U << i : 0U;
        for (std::size_t k = 0; k < states.size(); ++k) {
          if (states[k].size() != M::kStates || k >= inputs.size() || inputs[k].size() != M::kInputs)
            throw Refusal(fmt::format("trajectory, instant {}: expected {} states and {} inputs of model {}", k, M::kStates,
                                      M::kInputs, M::kName));
          t.x.push_back(Eigen::Map<const Vector<double, M::kStates>>(states[k].data()));
          t.u.push_back(Eigen::Map<const Vector<double, M::kInputs>>(inputs[k].data()));
          t.measured.push_back(measured);
        }
        return along(make_belief(model, scenario, tuning), scenario, t);
      },
      process_of(scenario, tuning));
}

std::string observability_line(const Observability& o) {
  const bool unknown = !o.outputs.empty() && o.window_s == 0.0;
  if (o.observable() || unknown) return "";
  const std::vector<std::string> names = o.unobservable();
  const bool one = names.size() == 1;
  const std::string follow = o.fading ? fmt::format("{} follow{} from the model alone, in which errors fade",
                                                    one ? "its estimate" : "their estimates", one ? "s" : "")
                                      : fmt::format("{} integrated from the start and {} uncertainty grows",
                                                    one ? "its estimate is" : "their estimates are", one ? "its" : "their");
  std::string line =
      fmt::format("{} {} not observable from {} with model {} (rank {} of {}): {}", listed(names), one ? "is" : "are",
                  o.outputs.empty() ? "no sensor" : fmt::format("{}", fmt::join(o.outputs, ", ")), o.model, o.rank,
                  o.states.size(), follow);
  if (const std::vector<std::string> weak = o.weak(); !weak.empty())
    line += fmt::format("; {} {} hardly observable", listed(weak), weak.size() == 1 ? "is" : "are");
  return line;
}

}  // namespace slipstream
