// A nonlinear program that knows no solver:
//
//   min f(y)   subject to   c(y) = 0,   lower <= y <= upper
//
// with exact first and second derivatives. The Jacobian of c and the lower triangle of the Lagrangian's Hessian,
// sigma grad^2 f + sum_i lambda_i grad^2 c_i, are sparse triplets whose structure is fixed for given sizes.
#pragma once

#include <span>
#include <vector>

namespace slipstream {

struct Triplet {
  int row = 0;
  int column = 0;
};

class NonlinearProgram {
 public:
  virtual ~NonlinearProgram() = default;
  virtual int variables() const = 0;
  virtual int constraints() const = 0;
  virtual void bounds(std::span<double> lower, std::span<double> upper) const = 0;
  virtual void jacobian_structure(std::vector<Triplet>& entries) const = 0;
  virtual void hessian_structure(std::vector<Triplet>& entries) const = 0;

  virtual double objective(std::span<const double> y) = 0;
  virtual void gradient(std::span<const double> y, std::span<double> g) = 0;
  virtual void constraint_values(std::span<const double> y, std::span<double> c) = 0;
  virtual void jacobian_values(std::span<const double> y, std::span<double> values) = 0;
  virtual void hessian_values(std::span<const double> y, double sigma, std::span<const double> lambda,
                              std::span<double> values) = 0;
};

}  // namespace slipstream
