// The one place that names SUNDIALS: CVODE's variable-order BDF with a dense exact Jacobian and root finding.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace slipstream {

// x' = f(x), with event functions g(x) whose zero crossings stop the integration.
struct OdeSystem {
  int states = 0;
  int events = 0;
  std::function<void(const double* x, double* x_dot)> derivative;
  std::function<void(const double* x, double* jacobian_column_major)> jacobian;
  std::function<void(const double* x, double* g)> event_values;
  std::vector<int> crossing_direction;  // per event: +1 rising, -1 falling, 0 both
};

struct CvodeTolerances {
  double relative = 1e-8;
  double absolute = 1e-10;
};

class CvodeIntegrator {
 public:
  // Starts at time 0 from x0. The system's functions must outlive the integrator.
  CvodeIntegrator(OdeSystem system, CvodeTolerances tolerances, std::span<const double> x0);
  ~CvodeIntegrator();
  CvodeIntegrator(const CvodeIntegrator&) = delete;
  CvodeIntegrator& operator=(const CvodeIntegrator&) = delete;

  // Integrates to t_s, or to the first event before it. Returns the event that stopped it, or nothing. Internal steps may run
  // past t_s and are interpolated, so frequent samples do not restart the integrator.
  std::optional<int> advance(double t_s);

  // Discards the history and goes on from the present time and x: call after every discontinuity.
  void restart(std::span<const double> x);

  double time_s() const;
  std::span<const double> state() const;
  long steps() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace slipstream
