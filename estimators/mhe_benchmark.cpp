// The MHE's step through the process's own interface, in pairs with a bare, warm-started Ipopt solve of the same windows: a
// program written out by hand for this one model, with hand-made derivatives, the same options and nothing around it.
//
// And the same step by real-time iteration (rti_*): rti_window*, of the same model (three states, two outputs); rti_wheel*, of
// the wheel and its friction alone (two states, the hierarchical observer's first level). Arguments: N, and whether the
// friction's upper bound is so low that it holds most of the time; `held`, the share of steps in which it does.
//
// Counters: the medians and 99th percentiles of both in microseconds, and `ratio`, the median of the pairs' ratios.
#include <benchmark/benchmark.h>

#include <IpIpoptApplication.hpp>
#include <IpTNLP.hpp>
#include <algorithm>
#include <array>
#include <chrono>
#include <memory>
#include <vector>

#include "common/check.hpp"
#include "common/random.hpp"
#include "estimators/ekf.hpp"
#include "estimators/mhe.hpp"
#include "estimators/rti.hpp"
#include "models/vehicles/unimog.hpp"
#include "plant/vehicle_simulation.hpp"

namespace slipstream {
namespace {

using Model = LongitudinalFriction;
using Ipopt::Index;
using Ipopt::Number;

struct Sample {
  std::array<double, 1> torque_before;  // that acted until this instant
  std::array<double, 2> z;
};

std::vector<Sample> unimog_drive() {
  Unimog vehicle;
  vehicle.prepare();
  VehicleSimulation<Unimog> simulation(vehicle, {});
  RandomStream random(1, 0, "benchmark");
  std::vector<Sample> samples;
  double torque = 0.0;
  for (int k = 0; k <= 1000; ++k) {
    simulation.advance(0.01 * k);
    const auto truth = vehicle.truth(simulation.state(), simulation.mode());
    samples.push_back({{torque}, {truth[0] * (1.0 + 0.05 * random.normal()), truth[3] * (1.0 + 0.05 * random.normal())}});
    torque = truth[6];
  }
  return samples;
}

Belief<Model> matched_belief() {
  Belief<Model> b;
  b.noise = {{{0.05, 0.0}, {0.05, 0.0}}};
  b.process_variance = {1e-3, 1e-8, 5e-4};
  b.initial_mean = {0.5, 0.26, 0.0};
  b.initial_variance = {1e-2, 1e-3, 0.04};
  b.lower = {-1.0, -1.0, -1.2};
  b.upper = {400.0, 100.0, 1.2};
  return b;
}

// One window as numbers: what a bare solve is given for nothing.
struct Window {
  Eigen::Vector3d arrival, scale;
  Eigen::Matrix3d information;  // of the arrival cost, scaled
  std::vector<Eigen::Vector3d> reference;
  std::vector<double> torque;
  std::vector<std::array<double, 2>> z, weight;
};

constexpr double kDt = 0.01;

// The windows that slide over the drive; their arrival cost is the EKF's prediction, which is what the MHE carries along.
std::vector<Window> windows(const std::vector<Sample>& drive, int intervals) {
  const Belief<Model> b = matched_belief();
  std::vector<Gaussian<Model>> prior, posterior;
  std::vector<std::array<double, 2>> weight;
  Gaussian<Model> x{b.initial_mean, b.initial_variance.asDiagonal()};
  for (std::size_t k = 0; k < drive.size(); ++k) {
    const Vector<double, 1> u(drive[k].torque_before[0]);
    if (k > 0) x = predict(b, x, u, kDt);
    prior.push_back(x);
    const Innovation<Model> i = innovate(b, x, u, drive[k].z.data(), 3U);
    weight.push_back({1.0 / i.noise[0], 1.0 / i.noise[1]});
    x = update(x, i);
    posterior.push_back(x);
  }
  std::vector<Window> result;
  const auto n = static_cast<std::size_t>(intervals);
  for (std::size_t k = n; k < drive.size(); ++k) {
    Window w;
    w.arrival = prior[k - n].mean;
    w.scale = posterior[k].covariance.diagonal().cwiseSqrt();
    w.information = w.scale.asDiagonal() * prior[k - n].covariance.inverse() * w.scale.asDiagonal();
    for (std::size_t i = k - n; i <= k; ++i) {
      w.reference.emplace_back(posterior[i].mean);
      w.torque.push_back(drive[i].torque_before[0]);
      w.z.push_back(drive[i].z);
      w.weight.push_back(weight[i]);
    }
    result.push_back(w);
  }
  return result;
}

// The same program as MultipleShooting, for this model only and by hand. v+ by Runge-Kutta with its sensitivities; in the
// Hessian the drag's curvature is -2 c dt.
class BareProgram final : public Ipopt::TNLP {
 public:
  const Window* window = nullptr;
  bool warm = false;

  bool get_nlp_info(Index& n, Index& m, Index& jacobian, Index& hessian, IndexStyleEnum& style) override {
    const int intervals = count();
    n = 3 * (2 * intervals + 1);
    m = 3 * intervals;
    jacobian = intervals * (3 + 9 + 3);
    hessian = 6 * (intervals + 1) + 3 * intervals;
    style = C_STYLE;
    solution_.resize(static_cast<std::size_t>(n));
    lower_.resize(solution_.size());
    upper_.resize(solution_.size());
    lambda_.resize(static_cast<std::size_t>(m));
    return true;
  }
  bool get_bounds_info(Index n, Number* lower, Number* upper, Index m, Number* g_lower, Number* g_upper) override {
    const Belief<Model> b = matched_belief();
    std::fill_n(lower, n, -2e19);
    std::fill_n(upper, n, 2e19);
    for (int i = 0; i <= count(); ++i)
      for (int k = 0; k < 3; ++k) {
        lower[6 * i + k] = (b.lower[k] - reference(i)[k]) / window->scale[k];
        upper[6 * i + k] = (b.upper[k] - reference(i)[k]) / window->scale[k];
      }
    std::fill_n(g_lower, m, 0.0);
    std::fill_n(g_upper, m, 0.0);
    return true;
  }
  bool get_starting_point(Index n, bool init_x, Number* x, bool init_z, Number* z_lower, Number* z_upper, Index m,
                          bool init_lambda, Number* lambda) override {
    if (init_x) std::fill_n(x, n, 0.0);
    if (init_z) std::copy_n(lower_.begin(), n, z_lower);
    if (init_z) std::copy_n(upper_.begin(), n, z_upper);
    if (init_lambda) std::copy_n(lambda_.begin(), m, lambda);
    return true;
  }
  bool eval_f(Index, const Number* y, bool, Number& value) override {
    const Eigen::Vector3d off = (state(y, 0) - window->arrival).cwiseQuotient(window->scale);
    value = 0.5 * off.dot(window->information * off);
    for (int i = 0; i <= count(); ++i) {
      const auto r = residual(i, state(y, i));
      value += 0.5 * (weight(i)[0] * r[0] * r[0] + weight(i)[1] * r[1] * r[1]);
    }
    for (int i = 0; i < count(); ++i)
      for (int k = 0; k < 3; ++k) value += 0.5 * y[6 * i + 3 + k] * y[6 * i + 3 + k];
    return true;
  }
  bool eval_grad_f(Index, const Number* y, bool, Number* g) override {
    for (int i = 0; i <= count(); ++i) {
      const Eigen::Vector3d x = state(y, i);
      const auto r = residual(i, x);
      Eigen::Vector3d slope(-weight(i)[0] * r[0], 2.0 * kDrag * x[1] * weight(i)[1] * r[1], -kG * weight(i)[1] * r[1]);
      slope = slope.cwiseProduct(window->scale).eval();
      if (i == 0) slope += window->information * (x - window->arrival).cwiseQuotient(window->scale);
      for (int k = 0; k < 3; ++k) g[6 * i + k] = slope[k];
      if (i < count())
        for (int k = 0; k < 3; ++k) g[6 * i + 3 + k] = y[6 * i + 3 + k];
    }
    return true;
  }
  bool eval_g(Index, const Number* y, bool, Index, Number* g) override {
    for (int i = 0; i < count(); ++i) {
      const Eigen::Vector3d next = state(y, i + 1), reached = flow(state(y, i), window->torque[at(i + 1)]).x;
      for (int k = 0; k < 3; ++k) g[3 * i + k] = (next[k] - reached[k] - sigma()[k] * y[6 * i + 3 + k]) / window->scale[k];
    }
    return true;
  }
  bool eval_jac_g(Index, const Number* y, bool, Index, Index, Index* rows, Index* columns, Number* values) override {
    int e = 0;
    for (int i = 0; i < count(); ++i) {
      if (values == nullptr) {
        for (int r = 0; r < 3; ++r) put(rows, columns, e, 3 * i + r, 6 * i + 6 + r);
        for (int r = 0; r < 3; ++r)
          for (int c = 0; c < 3; ++c) put(rows, columns, e, 3 * i + r, 6 * i + c);
        for (int r = 0; r < 3; ++r) put(rows, columns, e, 3 * i + r, 6 * i + 3 + r);
        continue;
      }
      const Flow f = flow(state(y, i), window->torque[at(i + 1)]);
      Eigen::Matrix3d j;
      j << 1.0, 0.0, -kGrip * kDt, 0.0, f.dv, f.dmu, 0.0, 0.0, 1.0;
      for (int r = 0; r < 3; ++r) values[e++] = 1.0;
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) values[e++] = -j(r, c) * window->scale[c] / window->scale[r];
      for (int r = 0; r < 3; ++r) values[e++] = -sigma()[r] / window->scale[r];
    }
    return true;
  }
  bool eval_h(Index, const Number* y, bool, Number obj, Index, const Number* lambda, bool, Index, Index* rows, Index* columns,
              Number* values) override {
    int e = 0;
    for (int i = 0; i <= count(); ++i) {
      if (values == nullptr) {
        for (int r = 0; r < 3; ++r)
          for (int c = 0; c <= r; ++c) put(rows, columns, e, 6 * i + r, 6 * i + c);
        if (i < count())
          for (int r = 0; r < 3; ++r) put(rows, columns, e, 6 * i + 3 + r, 6 * i + 3 + r);
        continue;
      }
      const Eigen::Vector3d x = state(y, i);
      const auto r = residual(i, x);
      const double a_v = -2.0 * kDrag * x[1];
      Eigen::Matrix3d h = Eigen::Matrix3d::Zero();
      h(0, 0) = weight(i)[0];
      h(1, 1) = weight(i)[1] * (a_v * a_v + 2.0 * kDrag * r[1]);
      h(2, 1) = weight(i)[1] * a_v * kG;
      h(2, 2) = weight(i)[1] * kG * kG;
      h *= obj;
      if (i < count()) h(1, 1) += lambda[3 * i + 1] / window->scale[1] * 2.0 * kDrag * kDt;
      h = (window->scale.asDiagonal() * h * window->scale.asDiagonal()).eval();
      if (i == 0) h += obj * window->information;
      for (int row = 0; row < 3; ++row)
        for (int c = 0; c <= row; ++c) values[e++] = h(row, c);
      if (i < count())
        for (int k = 0; k < 3; ++k) values[e++] = obj;
    }
    return true;
  }
  void finalize_solution(Ipopt::SolverReturn status, Index n, const Number* x, const Number* z_lower, const Number* z_upper,
                         Index m, const Number*, const Number* lambda, Number, const Ipopt::IpoptData*,
                         Ipopt::IpoptCalculatedQuantities*) override {
    warm = status == Ipopt::SUCCESS || status == Ipopt::STOP_AT_ACCEPTABLE_POINT;
    std::copy_n(x, n, solution_.begin());
    std::copy_n(z_lower, n, lower_.begin());
    std::copy_n(z_upper, n, upper_.begin());
    std::copy_n(lambda, m, lambda_.begin());
  }
  std::vector<Eigen::Vector3d> states() const {
    std::vector<Eigen::Vector3d> x;
    for (int i = 0; i <= count(); ++i) x.push_back(state(solution_.data(), i));
    return x;
  }

 private:
  static constexpr double kG = 9.81;
  static constexpr double kGrip = 2000.0 * kG * 0.52 / 11.5;
  static constexpr double kDrag = 0.5 * 1.2 * 0.6 * 5.6 / 2000.0;

  struct Flow {
    Eigen::Vector3d x;
    double dv, dmu;  // of v+
  };
  static Flow flow(const Eigen::Vector3d& x, double torque) {
    double k = 0.0, k_v = 0.0, k_mu = 0.0, sum = 0.0, sum_v = 0.0, sum_mu = 0.0;
    constexpr std::array<double, 4> reach{0.0, 0.5, 0.5, 1.0}, part{1.0, 2.0, 2.0, 1.0};
    for (std::size_t s = 0; s < 4; ++s) {
      const double v = x[1] + reach[s] * kDt * k, v_v = 1.0 + reach[s] * kDt * k_v, v_mu = reach[s] * kDt * k_mu;
      k = kG * x[2] - kDrag * v * v;
      k_v = -2.0 * kDrag * v * v_v;
      k_mu = kG - 2.0 * kDrag * v * v_mu;
      sum += part[s] * k;
      sum_v += part[s] * k_v;
      sum_mu += part[s] * k_mu;
    }
    return {{x[0] + kDt * (torque / 11.5 - kGrip * (x[2] + 0.02)), x[1] + kDt / 6.0 * sum, x[2]},
            1.0 + kDt / 6.0 * sum_v,
            kDt / 6.0 * sum_mu};
  }
  static std::size_t at(int i) { return static_cast<std::size_t>(i); }
  static void put(Index* rows, Index* columns, int& e, int row, int column) {
    rows[e] = row;
    columns[e++] = column;
  }
  static Eigen::Vector3d sigma() { return matched_sigma; }
  inline static const Eigen::Vector3d matched_sigma = Eigen::Vector3d(1e-3 * kDt, 1e-8 * kDt, 5e-4 * kDt).cwiseSqrt();
  int count() const { return static_cast<int>(window->z.size()) - 1; }
  const Eigen::Vector3d& reference(int i) const { return window->reference[at(i)]; }
  const std::array<double, 2>& weight(int i) const { return window->weight[at(i)]; }
  Eigen::Vector3d state(const Number* y, int i) const {
    return reference(i) + window->scale.cwiseProduct(Eigen::Map<const Eigen::Vector3d>(y + 6 * i));
  }
  std::array<double, 2> residual(int i, const Eigen::Vector3d& x) const {
    const auto& z = window->z[at(i)];
    return {z[0] - x[0], z[1] - (kG * x[2] - kDrag * x[1] * x[1])};
  }

  std::vector<double> solution_, lower_, upper_, lambda_;
};

class BareSolver {
 public:
  BareSolver() : app_(new Ipopt::IpoptApplication(false)), program_(new BareProgram) {
    auto options = app_->Options();
    bool known = options->SetIntegerValue("print_level", 0) && options->SetStringValue("sb", "yes") &&
                 options->SetStringValue("linear_solver", "mumps") && options->SetNumericValue("tol", 1e-6) &&
                 options->SetNumericValue("acceptable_tol", 1e-5) && options->SetStringValue("nlp_scaling_method", "none") &&
                 options->SetStringValue("mu_strategy", "monotone") &&
                 options->SetStringValue("accept_every_trial_step", "yes") && options->SetStringValue("alpha_for_y", "full") &&
                 options->SetIntegerValue("mumps_permuting_scaling", 0) && options->SetIntegerValue("mumps_pivot_order", 0) &&
                 options->SetIntegerValue("mumps_scaling", 0);
    for (const char* name : {"bound_relax_factor", "mu_target"}) known = known && options->SetNumericValue(name, 0.0);
    for (const char* name : {"bound_push", "bound_frac", "slack_bound_push", "slack_bound_frac"})
      known = known && options->SetNumericValue(name, 1e-6);
    for (const char* name : {"warm_start_bound_push", "warm_start_bound_frac", "warm_start_slack_bound_push",
                             "warm_start_slack_bound_frac", "warm_start_mult_bound_push"})
      known = known && options->SetNumericValue(name, 1e-9);
    SLIPSTREAM_CHECK(known && app_->Initialize() == Ipopt::Solve_Succeeded);
  }
  // Takes the window and starts from the last solution, moved on by one sample.
  void prepare(const Window& window) {
    window_ = window;
    if (program_->warm)
      for (std::size_t i = 0; i + 1 < window_.reference.size(); ++i) window_.reference[i] = last_[i + 1];
  }
  void solve() {
    program_->window = &window_;
    auto options = app_->Options();
    options->SetStringValue("warm_start_init_point", program_->warm ? "yes" : "no");
    options->SetStringValue("warm_start_same_structure", program_->warm ? "yes" : "no");
    options->SetNumericValue("mu_init", program_->warm ? 1e-9 : 1e-5);
    const Ipopt::SmartPtr<Ipopt::TNLP> nlp = &*program_;
    if (program_->warm) {
      app_->ReOptimizeTNLP(nlp);
    } else {
      app_->OptimizeTNLP(nlp);
    }
  }
  // The newest state; keeps the solution for the next start.
  Eigen::Vector3d finish() {
    last_ = program_->states();
    return last_.back();
  }

 private:
  Window window_;
  std::vector<Eigen::Vector3d> last_;
  Ipopt::SmartPtr<Ipopt::IpoptApplication> app_;
  Ipopt::SmartPtr<BareProgram> program_;
};

double percentile(std::vector<double> values, double p) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(p * static_cast<double>(values.size() - 1))];
}

void mhe_step_beside_bare_ipopt(benchmark::State& state) {
  using Clock = std::chrono::steady_clock;
  const auto intervals = static_cast<int>(state.range(0));
  const std::vector<Sample> drive = unimog_drive();
  const std::vector<Window> bare_windows = windows(drive, intervals);
  std::vector<double> ours, bare, ratio;
  // Largest difference of the newest states. Not zero: the bare window gets the EKF's prediction as its arrival cost.
  double apart = 0.0;
  for (auto _ : state) {
    const std::unique_ptr<Estimator> mhe = std::make_unique<Mhe<Model>>(matched_belief(), intervals);
    BareSolver solver;
    mhe->start_given();
    for (std::size_t k = 0; k < drive.size(); ++k) {
      const auto t0 = Clock::now();
      mhe->step({k == 0 ? 0.0 : kDt, drive[k].torque_before, drive[k].z, 3U});
      const auto t1 = Clock::now();
      if (k < static_cast<std::size_t>(intervals)) continue;
      solver.prepare(bare_windows[k - static_cast<std::size_t>(intervals)]);
      const auto t2 = Clock::now();
      solver.solve();
      const auto t3 = Clock::now();
      const Eigen::Vector3d x = solver.finish();
      if (k < static_cast<std::size_t>(intervals) + 10) continue;  // both warm
      const auto p = mhe->posterior();
      SLIPSTREAM_CHECK(p.status == EstimateStatus::kValid);
      for (int i = 0; i < 3; ++i) apart = std::max(apart, std::abs(p.mean[static_cast<std::size_t>(i)] - x[i]));
      ours.push_back(std::chrono::duration<double, std::micro>(t1 - t0).count());
      bare.push_back(std::chrono::duration<double, std::micro>(t3 - t2).count());
      ratio.push_back(ours.back() / bare.back());
    }
  }
  state.counters["ours_p50_us"] = percentile(ours, 0.5);
  state.counters["ours_p99_us"] = percentile(ours, 0.99);
  state.counters["bare_p50_us"] = percentile(bare, 0.5);
  state.counters["bare_p99_us"] = percentile(bare, 0.99);
  state.counters["ratio"] = percentile(ratio, 0.5);
  state.counters["apart"] = apart;
}
BENCHMARK(mhe_step_beside_bare_ipopt)->Arg(4)->Arg(10)->Arg(20)->Iterations(3)->Unit(benchmark::kMillisecond);

// Without process noise: the document's weights V and S, and its model.
constexpr std::array<NoiseLaw, 2> kDocumentNoise{{{0.0, 1e-2}, {0.0, 1e-4}}};
const Eigen::Vector3d kDocumentArrival(1e4, 1e5, 1e5);

Belief<Model> document_belief() {
  Belief<Model> b = matched_belief();
  b.model.drag = false;
  b.noise = kDocumentNoise;
  return b;
}

void mhe_step_document_form(benchmark::State& state) {
  const std::vector<Sample> drive = unimog_drive();
  const std::unique_ptr<Estimator> mhe =
      std::make_unique<MheSingleShooting<Model>>(document_belief(), static_cast<int>(state.range(0)), kDocumentArrival);
  mhe->start_given();
  std::size_t k = 0;
  for (auto _ : state) {
    if (k == drive.size()) {
      k = 0;
      mhe->start_given();
    }
    mhe->step({k == 0 ? 0.0 : kDt, drive[k].torque_before, drive[k].z, 3U});
    ++k;
  }
}
BENCHMARK(mhe_step_document_form)->Arg(4)->Unit(benchmark::kMicrosecond);

constexpr double kHeld = 0.1;  // an upper bound of the friction that holds

Belief<WheelFriction> wheel_belief() {
  const Belief<Model> all = matched_belief();
  Belief<WheelFriction> b;
  b.noise = all.noise;
  b.process_variance = {1e-3, 5e-4};
  b.initial_mean = {0.5, 0.0};
  b.initial_variance = {1e-2, 0.04};
  b.lower = {-1.0, -1.2};
  b.upper = {400.0, 1.2};
  return b;
}

// The friction is the last state of either model.
template <typename M>
Belief<M> bounded(Belief<M> b, const benchmark::State& state) {
  if (state.range(1) != 0) b.upper[M::kStates - 1] = kHeld;
  return b;
}

// One iteration is one step: prediction, weights, linearisation of the whole window, program, KKT residual, covariance.
void time_steps(benchmark::State& state, Estimator& mhe) {
  const std::vector<Sample> drive = unimog_drive();
  double residual = 0.0, failed = 0.0, held = 0.0;
  std::size_t k = drive.size();
  for (auto _ : state) {
    if (k == drive.size()) {
      k = 0;
      mhe.start_given();
    }
    mhe.step({k == 0 ? 0.0 : kDt, drive[k].torque_before, drive[k].z, 3U});
    ++k;
    const Posterior p = mhe.posterior();
    failed += p.status == EstimateStatus::kValid ? 0.0 : 1.0;
    held += p.mean.back() == kHeld ? 1.0 : 0.0;
    residual = std::max(residual, p.kkt_residual);  // a fallback's, which is not a number, is passed over
  }
  state.counters["kkt_max"] = residual;
  state.counters["fallback"] = benchmark::Counter(failed, benchmark::Counter::kAvgIterations);
  state.counters["held"] = benchmark::Counter(held, benchmark::Counter::kAvgIterations);
}

void rti_window(benchmark::State& state) {
  RtiMhe<Model> mhe(bounded(matched_belief(), state), static_cast<int>(state.range(0)));
  time_steps(state, mhe);
}
BENCHMARK(rti_window)->ArgsProduct({{4, 20}, {0, 1}})->ArgNames({"N", "held"});

void rti_window_without_process_noise(benchmark::State& state) {
  RtiSingleShooting<Model> mhe(bounded(document_belief(), state), static_cast<int>(state.range(0)), kDocumentArrival);
  time_steps(state, mhe);
}
BENCHMARK(rti_window_without_process_noise)->ArgsProduct({{4, 20}, {0, 1}})->ArgNames({"N", "held"});

void rti_wheel(benchmark::State& state) {
  RtiMhe<WheelFriction> mhe(bounded(wheel_belief(), state), static_cast<int>(state.range(0)));
  time_steps(state, mhe);
}
BENCHMARK(rti_wheel)->ArgsProduct({{4, 20}, {0, 1}})->ArgNames({"N", "held"});

void rti_wheel_without_process_noise(benchmark::State& state) {
  Belief<WheelFriction> belief = bounded(wheel_belief(), state);
  belief.noise = kDocumentNoise;
  RtiSingleShooting<WheelFriction> mhe(belief, static_cast<int>(state.range(0)), Eigen::Vector2d(1e4, 1e5));
  time_steps(state, mhe);
}
BENCHMARK(rti_wheel_without_process_noise)->ArgsProduct({{4, 20}, {0, 1}})->ArgNames({"N", "held"});

void rti_lateral(benchmark::State& state) {
  Belief<LateralBicycle> b;
  b.noise = {{{0.0, 0.3}, {0.0, 0.02}}};
  b.process_variance << 1e-3, 1e-3, 1e-6, 1e-4, 1e-4, 1e-2, 1e-2;
  b.initial_mean << 0.0, 0.0, 0.0, 0.0, 0.0, 18.0, 20.0;
  b.initial_variance << 1e-2, 1e-2, 1e-4, 1e-2, 1e-2, 4.0, 4.0;
  RtiMhe<LateralBicycle> mhe(b, static_cast<int>(state.range(0)));
  mhe.start_given();
  double t_s = 0.0;
  for (auto _ : state) {
    const std::array<double, 2> u{0.1 * std::sin(t_s), 50.0}, z{0.8 * std::sin(t_s), 0.5 * std::sin(t_s)};
    mhe.step({t_s == 0.0 ? 0.0 : kDt, u, z, 3U});
    t_s += kDt;
  }
}
BENCHMARK(rti_lateral)->Arg(4)->Arg(20);

}  // namespace
}  // namespace slipstream

BENCHMARK_MAIN();
