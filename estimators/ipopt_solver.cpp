#include "estimators/ipopt_solver.hpp"

#include <IpIpoptApplication.hpp>
#include <IpJournalist.hpp>
#include <IpSolveStatistics.hpp>
#include <IpTNLP.hpp>
#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <mutex>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/check.hpp"

namespace slipstream {

namespace {

using Ipopt::Index;
using Ipopt::Number;

// Ipopt 3.11 with MUMPS crashes when two threads solve at once, even in objects of their own.
std::mutex& solve_mutex() {
  static std::mutex mutex;
  return mutex;
}

// Translates between Ipopt's call-backs and a NonlinearProgram, and keeps what the next warm start needs.
class Adapter final : public Ipopt::TNLP {
 public:
  void aim(NonlinearProgram& program, std::span<const double> start) {
    program_ = &program;
    const auto n = static_cast<std::size_t>(program.variables());
    const auto m = static_cast<std::size_t>(program.constraints());
    SLIPSTREAM_CHECK(start.size() == n);
    if (lambda_.size() != m || lower_multiplier_.size() != n) forget();
    lambda_.resize(m);
    lower_multiplier_.resize(n);
    upper_multiplier_.resize(n);
    start_.assign(start.begin(), start.end());
    solution_.resize(n);
    jacobian_.clear();
    hessian_.clear();
    program.jacobian_structure(jacobian_);
    program.hessian_structure(hessian_);
  }
  bool warm() const { return warm_; }
  void forget() { warm_ = false; }
  std::span<const double> solution() const { return solution_; }

  bool get_nlp_info(Index& n, Index& m, Index& jacobian_entries, Index& hessian_entries, IndexStyleEnum& style) override {
    n = program_->variables();
    m = program_->constraints();
    jacobian_entries = static_cast<Index>(jacobian_.size());
    hessian_entries = static_cast<Index>(hessian_.size());
    style = C_STYLE;
    return true;
  }
  bool get_bounds_info(Index n, Number* lower, Number* upper, Index m, Number* c_lower, Number* c_upper) override {
    program_->bounds(of(lower, n), of(upper, n));
    constexpr double kIpoptInfinity = 2e19;
    for (Index i = 0; i < n; ++i) {
      lower[i] = std::max(lower[i], -kIpoptInfinity);
      upper[i] = std::min(upper[i], kIpoptInfinity);
    }
    std::fill_n(c_lower, m, 0.0);
    std::fill_n(c_upper, m, 0.0);
    return true;
  }
  bool get_starting_point(Index n, bool init_y, Number* y, bool init_z, Number* z_lower, Number* z_upper, Index m,
                          bool init_lambda, Number* lambda) override {
    if (init_y) std::copy_n(start_.begin(), n, y);
    if (init_z) std::copy_n(lower_multiplier_.begin(), n, z_lower);
    if (init_z) std::copy_n(upper_multiplier_.begin(), n, z_upper);
    if (init_lambda) std::copy_n(lambda_.begin(), m, lambda);
    return true;
  }
  bool eval_f(Index n, const Number* y, bool, Number& value) override {
    value = program_->objective(of(y, n));
    return true;
  }
  bool eval_grad_f(Index n, const Number* y, bool, Number* g) override {
    program_->gradient(of(y, n), of(g, n));
    return true;
  }
  bool eval_g(Index n, const Number* y, bool, Index m, Number* c) override {
    program_->constraint_values(of(y, n), of(c, m));
    return true;
  }
  bool eval_jac_g(Index n, const Number* y, bool, Index, Index entries, Index* rows, Index* columns, Number* values) override {
    if (values == nullptr) {
      structure(jacobian_, rows, columns);
    } else {
      program_->jacobian_values(of(y, n), of(values, entries));
    }
    return true;
  }
  bool eval_h(Index n, const Number* y, bool, Number sigma, Index m, const Number* lambda, bool, Index entries, Index* rows,
              Index* columns, Number* values) override {
    if (values == nullptr) {
      structure(hessian_, rows, columns);
    } else {
      program_->hessian_values(of(y, n), sigma, of(lambda, m), of(values, entries));
    }
    return true;
  }
  void finalize_solution(Ipopt::SolverReturn status, Index n, const Number* y, const Number* z_lower, const Number* z_upper,
                         Index m, const Number*, const Number* lambda, Number, const Ipopt::IpoptData*,
                         Ipopt::IpoptCalculatedQuantities*) override {
    warm_ = status == Ipopt::SUCCESS || status == Ipopt::STOP_AT_ACCEPTABLE_POINT;
    if (!warm_) return;
    std::copy_n(y, n, solution_.begin());
    std::copy_n(z_lower, n, lower_multiplier_.begin());
    std::copy_n(z_upper, n, upper_multiplier_.begin());
    std::copy_n(lambda, m, lambda_.begin());
  }

 private:
  template <typename T>
  static std::span<T> of(T* p, Index n) {
    return {p, static_cast<std::size_t>(n)};
  }
  static void structure(const std::vector<Triplet>& entries, Index* rows, Index* columns) {
    for (std::size_t i = 0; i < entries.size(); ++i) {
      rows[i] = entries[i].row;
      columns[i] = entries[i].column;
    }
  }

  NonlinearProgram* program_ = nullptr;
  bool warm_ = false;
  std::vector<double> start_, solution_, lower_multiplier_, upper_multiplier_, lambda_;
  std::vector<Triplet> jacobian_, hessian_;
};

void require(bool accepted, const std::string& option) {
  if (!accepted) throw std::runtime_error("Ipopt does not know the option " + option);
}

class Application {
 public:
  Application() : app_(new Ipopt::IpoptApplication(false)) {
    set("print_level", 0);
    set("sb", "yes");
    set("linear_solver", "mumps");
  }
  void set(const std::string& name, double value) { require(app_->Options()->SetNumericValue(name, value), name); }
  void set(const std::string& name, int value) { require(app_->Options()->SetIntegerValue(name, value), name); }
  void set(const std::string& name, const char* value) { require(app_->Options()->SetStringValue(name, value), name); }
  void initialize() { require(app_->Initialize() == Ipopt::Solve_Succeeded, "set as a whole"); }
  Ipopt::IpoptApplication* operator->() { return &*app_; }

 private:
  Ipopt::SmartPtr<Ipopt::IpoptApplication> app_;
};

// Counts what Ipopt's derivative checker complains about.
class CountingJournal final : public Ipopt::Journal {
 public:
  CountingJournal() : Journal("derivatives", Ipopt::J_ITERSUMMARY) { SetAllPrintLevels(Ipopt::J_ITERSUMMARY); }
  int disagreements = 0;

 protected:
  void PrintImpl(Ipopt::EJournalCategory, Ipopt::EJournalLevel, const char* text) override {
    if (text[0] == '*') ++disagreements;
  }
  void PrintfImpl(Ipopt::EJournalCategory, Ipopt::EJournalLevel, const char* format, va_list arguments) override {
    char text[512];
    std::vsnprintf(text, sizeof text, format, arguments);
    if (text[0] == '*') ++disagreements;
  }
  void FlushBufferImpl() override {}
};

// Convergence in units of the program's own scaling: the windows are scaled by the estimate's standard deviation.
void set_common(Application& app) {
  app.set("tol", 1e-6);
  app.set("acceptable_tol", 1e-5);
  app.set("nlp_scaling_method", "none");
  app.set("bound_relax_factor", 0.0);
  app.set("mu_strategy", "monotone");
  app.set("mu_target", 0.0);
  app.set("max_iter", 100);
}

}  // namespace

struct IpoptSolver::Impl {
  Application fast, safe;
  Ipopt::SmartPtr<Adapter> adapter = new Adapter;
  bool used = false;

  Impl() {
    set_common(fast);
    fast.set("bound_push", 1e-6);
    fast.set("bound_frac", 1e-6);
    fast.set("slack_bound_push", 1e-6);
    fast.set("slack_bound_frac", 1e-6);
    fast.set("mu_init", 1e-5);
    fast.set("accept_every_trial_step", "yes");
    fast.set("alpha_for_y", "full");
    fast.set("max_iter", 30);
    fast.set("mumps_permuting_scaling", 0);
    fast.set("mumps_pivot_order", 0);
    fast.set("mumps_scaling", 0);
    fast.set("warm_start_bound_push", 1e-9);
    fast.set("warm_start_bound_frac", 1e-9);
    fast.set("warm_start_slack_bound_push", 1e-9);
    fast.set("warm_start_slack_bound_frac", 1e-9);
    fast.set("warm_start_mult_bound_push", 1e-9);
    fast.initialize();
    set_common(safe);
    safe.initialize();
  }
};

IpoptSolver::IpoptSolver() : impl_(std::make_unique<Impl>()) {}
IpoptSolver::~IpoptSolver() = default;

SolveResult IpoptSolver::solve(NonlinearProgram& program, std::span<double> y) {
  const std::scoped_lock lock(solve_mutex());
  Impl& s = *impl_;
  const auto converged = [](Ipopt::ApplicationReturnStatus status) {
    return status == Ipopt::Solve_Succeeded || status == Ipopt::Solved_To_Acceptable_Level;
  };
  SolveResult result;
  s.adapter->aim(program, y);
  const bool warm = s.used && s.adapter->warm();
  s.fast.set("warm_start_init_point", warm ? "yes" : "no");
  s.fast.set("warm_start_same_structure", warm ? "yes" : "no");
  s.fast.set("mu_init", warm ? 1e-9 : 1e-5);
  const Ipopt::SmartPtr<Ipopt::TNLP> nlp = &*s.adapter;
  result.converged = converged(warm ? s.fast->ReOptimizeTNLP(nlp) : s.fast->OptimizeTNLP(nlp));
  s.used = true;
  const auto describe = [&](Application& app) {
    const auto statistics = app->Statistics();
    if (!IsValid(statistics)) return;
    result.iterations = statistics->IterationCount();
    Number dual = 0.0, primal = 0.0, complementarity = 0.0;
    if (result.converged) statistics->Infeasibilities(dual, primal, complementarity, result.kkt_residual);
  };
  describe(s.fast);
  if (!result.converged) {
    result.safe_options_needed = true;
    s.adapter->forget();
    result.converged = converged(s.safe->OptimizeTNLP(nlp));
    describe(s.safe);
    s.used = false;  // the fast application has not seen this solution: start it cold next time
  }
  if (result.converged) {
    std::copy(s.adapter->solution().begin(), s.adapter->solution().end(), y.begin());
  } else {
    s.adapter->forget();
  }
  return result;
}

int IpoptSolver::check_derivatives(NonlinearProgram& program, std::span<const double> y) {
  // Ipopt writes its findings to its journal; a line with an asterisk is a disagreement.
  const std::scoped_lock lock(solve_mutex());
  Application app;
  set_common(app);
  app.set("derivative_test", "second-order");
  app.set("derivative_test_tol", 1e-4);  // differences of functions near 1e2 with steps of 1e-8
  app.set("derivative_test_perturbation", 1e-8);
  app.set("point_perturbation_radius", 0.0);
  app.set("max_iter", 0);
  app.initialize();
  CountingJournal* journal = new CountingJournal;  // owned by Ipopt's reference count
  app->Jnlst()->AddJournal(journal);
  const Ipopt::SmartPtr<Adapter> adapter = new Adapter;
  adapter->aim(program, y);
  app->OptimizeTNLP(&*adapter);
  return journal->disagreements;
}

}  // namespace slipstream
