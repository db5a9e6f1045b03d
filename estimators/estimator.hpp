// The one interface between the estimator process and its algorithms: chosen by a string, called once a step.
//
// A step belongs to one instant: predict over the time that really passed since the last one, then update with whatever was
// measured. Row-major arrays behind plain pointers, so that the process needs no template and nothing is copied.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/messages.hpp"
#include "models/vehicle.hpp"

namespace slipstream {

// Sizes that bound every algorithm's storage; a process model beyond them does not compile.
inline constexpr int kMaxStates = 32;
inline constexpr int kMaxOutputs = 16;
inline constexpr int kMaxInputs = 8;

struct StepInput {
  double dt_s = 0.0;                       // since the previous step; 0 on the first
  std::span<const double> input;           // one per model input: mean over dt_s, or at its end (ModelNames)
  std::span<const double> measured_value;  // one per model output; read only where measured
  std::uint32_t measured = 0;              // bit i: output i was measured at this instant
};

struct Posterior {
  EstimateStatus status = EstimateStatus::kInitialising;
  std::span<const double> mean;                   // n
  std::span<const double> covariance;             // n x n
  std::span<const double> innovation;             // one per model output; zero where not measured
  std::span<const double> innovation_covariance;  // outputs x outputs; valid between measured ones
  // n each: the 99 % credible interval of each state; empty where the algorithm gives none but the covariance's.
  std::span<const double> interval_low{};
  std::span<const double> interval_high{};
  // How far the published solution of a program is from satisfying its conditions of optimality (Karush, Kuhn, Tucker): the
  // largest, in standard deviations of the newest estimate. NaN: none was found; -1: the algorithm solves none.
  double kkt_residual = -1.0;
};

struct ModelNames {
  std::string_view model;
  std::span<const Quantity> states;
  std::span<const Quantity> inputs;
  std::span<const Quantity> outputs;
  bool inputs_at_end = false;  // the model wants them as they are at a step's instant, not their mean over it
};

class Estimator {
 public:
  virtual ~Estimator() = default;
  virtual ModelNames names() const = 0;

  // Starts from the tuning's initial mean and covariance.
  virtual void start_given() = 0;
  // Starts from a measured output z that fixes a start (its noise becomes part of the initial covariance); false if it does
  // not.
  virtual bool start_measured(int output, double z) = 0;

  // Predicts and updates. Allocates nothing once the first steps are past, save inside a general-purpose solver.
  virtual void step(const StepInput& step) = 0;

  // Of the last step; valid until the next.
  virtual Posterior posterior() const = 0;
};

}  // namespace slipstream
