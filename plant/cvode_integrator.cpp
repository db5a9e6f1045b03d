#include "plant/cvode_integrator.hpp"

#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

#include "common/check.hpp"

namespace slipstream {

constexpr int kMaxSteps = 100000;  // between two samples

struct CvodeIntegrator::Impl {
  OdeSystem system;
  SUNContext context = nullptr;
  N_Vector x = nullptr;  // the solution at `time`
  SUNMatrix matrix = nullptr;
  SUNLinearSolver solver = nullptr;
  void* cvode = nullptr;
  double time = 0.0;         // of x
  double reached = 0.0;      // the end of the last internal step, or the event in it
  std::optional<int> event;  // at `reached`, not yet reported
  std::vector<int> roots;

  static int derivative(realtype, N_Vector x, N_Vector x_dot, void* self) {
    static_cast<Impl*>(self)->system.derivative(N_VGetArrayPointer(x), N_VGetArrayPointer(x_dot));
    return 0;
  }
  static int jacobian(realtype, N_Vector x, N_Vector, SUNMatrix j, void* self, N_Vector, N_Vector, N_Vector) {
    static_cast<Impl*>(self)->system.jacobian(N_VGetArrayPointer(x), SUNDenseMatrix_Data(j));
    return 0;
  }
  static int events(realtype, N_Vector x, realtype* g, void* self) {
    static_cast<Impl*>(self)->system.event_values(N_VGetArrayPointer(x), g);
    return 0;
  }
  static void require(int flag, const char* call) {
    if (flag < 0) throw std::runtime_error(std::string("CVODE: ") + call + " failed with flag " + std::to_string(flag));
  }
  ~Impl() {
    if (cvode != nullptr) CVodeFree(&cvode);
    if (solver != nullptr) SUNLinSolFree(solver);
    if (matrix != nullptr) SUNMatDestroy(matrix);
    if (x != nullptr) N_VDestroy(x);
    if (context != nullptr) SUNContext_Free(&context);
  }
};

CvodeIntegrator::CvodeIntegrator(OdeSystem system, CvodeTolerances tolerances, std::span<const double> x0)
    : impl_(std::make_unique<Impl>()) {
  SLIPSTREAM_CHECK(static_cast<int>(x0.size()) == system.states);
  SLIPSTREAM_CHECK(static_cast<int>(system.crossing_direction.size()) == system.events);
  Impl& s = *impl_;
  s.system = std::move(system);
  s.roots.resize(static_cast<std::size_t>(s.system.events));
  Impl::require(SUNContext_Create(nullptr, &s.context), "SUNContext_Create");
  s.x = N_VNew_Serial(s.system.states, s.context);
  std::copy(x0.begin(), x0.end(), N_VGetArrayPointer(s.x));
  s.cvode = CVodeCreate(CV_BDF, s.context);
  SLIPSTREAM_CHECK(s.cvode != nullptr);
  Impl::require(CVodeInit(s.cvode, Impl::derivative, 0.0, s.x), "CVodeInit");
  Impl::require(CVodeSetUserData(s.cvode, impl_.get()), "CVodeSetUserData");
  Impl::require(CVodeSStolerances(s.cvode, tolerances.relative, tolerances.absolute), "CVodeSStolerances");
  s.matrix = SUNDenseMatrix(s.system.states, s.system.states, s.context);
  s.solver = SUNLinSol_Dense(s.x, s.matrix, s.context);
  Impl::require(CVodeSetLinearSolver(s.cvode, s.solver, s.matrix), "CVodeSetLinearSolver");
  Impl::require(CVodeSetJacFn(s.cvode, Impl::jacobian), "CVodeSetJacFn");
  if (s.system.events > 0) {
    Impl::require(CVodeRootInit(s.cvode, s.system.events, Impl::events), "CVodeRootInit");
    Impl::require(CVodeSetRootDirection(s.cvode, s.system.crossing_direction.data()), "CVodeSetRootDirection");
    Impl::require(CVodeSetNoInactiveRootWarn(s.cvode), "CVodeSetNoInactiveRootWarn");
  }
}

CvodeIntegrator::~CvodeIntegrator() = default;

std::optional<int> CvodeIntegrator::advance(double t_s) {
  Impl& s = *impl_;
  if (t_s <= s.time) return std::nullopt;
  // Whole steps towards a time that does not depend on t_s: who asks when must not change the solution by a bit.
  for (int steps = 0; !s.event && s.reached < t_s; ++steps) {
    if (steps == kMaxSteps) Impl::require(CV_TOO_MUCH_WORK, "CVode");  // its own limit counts only steps of one call
    const int flag = CVode(s.cvode, s.reached + 1.0, s.x, &s.reached, CV_ONE_STEP);
    Impl::require(flag, "CVode");
    if (flag != CV_ROOT_RETURN) continue;
    Impl::require(CVodeGetRootInfo(s.cvode, s.roots.data()), "CVodeGetRootInfo");
    const auto hit = std::find_if(s.roots.begin(), s.roots.end(), [](int r) { return r != 0; });
    SLIPSTREAM_CHECK(hit != s.roots.end());
    s.event = static_cast<int>(hit - s.roots.begin());
  }
  const bool stop = s.event && s.reached <= t_s;
  s.time = stop ? s.reached : t_s;
  Impl::require(CVodeGetDky(s.cvode, s.time, 0, s.x), "CVodeGetDky");
  return stop ? std::exchange(s.event, std::nullopt) : std::nullopt;
}

void CvodeIntegrator::restart(std::span<const double> x) {
  Impl& s = *impl_;
  SLIPSTREAM_CHECK(static_cast<int>(x.size()) == s.system.states);
  double* storage = N_VGetArrayPointer(s.x);
  if (x.data() != storage) std::copy(x.begin(), x.end(), storage);
  Impl::require(CVodeReInit(s.cvode, s.time, s.x), "CVodeReInit");
  s.reached = s.time;
  s.event.reset();
}

double CvodeIntegrator::time_s() const { return impl_->time; }

std::span<const double> CvodeIntegrator::state() const {
  return {N_VGetArrayPointer(impl_->x), static_cast<std::size_t>(impl_->system.states)};
}

long CvodeIntegrator::steps() const {
  long n = 0;
  Impl::require(CVodeGetNumSteps(impl_->cvode, &n), "CVodeGetNumSteps");
  return n;
}

}  // namespace slipstream
