// The one place that names Ipopt. A solver that is called again and again on slowly changing programs of the same structure.
//
// The first solve, and every solve whose sizes changed, starts cold; the next ones start from the multipliers of the last, with
// the structure kept. The fast options drop Ipopt's globalisation, which is right next to the solution only: when they do not
// converge, the same program is solved once more from the same point with safe options. After a failure nothing is kept.
#pragma once

#include <limits>
#include <memory>
#include <span>

#include "estimators/nlp.hpp"

namespace slipstream {

struct SolveResult {
  bool converged = false;
  bool safe_options_needed = false;
  int iterations = 0;
  double kkt_residual = std::numeric_limits<double>::quiet_NaN();  // of the solution, in the program's own units
};

class IpoptSolver {
 public:
  IpoptSolver();
  ~IpoptSolver();
  IpoptSolver(const IpoptSolver&) = delete;
  IpoptSolver& operator=(const IpoptSolver&) = delete;

  // y: in the start, out the solution (unchanged unless converged).
  SolveResult solve(NonlinearProgram& program, std::span<double> y);

  // Compares the program's derivatives with finite differences at y through Ipopt's own checker; the number of disagreements.
  static int check_derivatives(NonlinearProgram& program, std::span<const double> y);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace slipstream
