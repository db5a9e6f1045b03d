// A strictly convex quadratic program with bounds, solved exactly by guessing which bounds hold with equality:
//
//   min q(x)   subject to   lower <= x <= upper (and equations that the problem keeps to itself)
//   optimal:   grad q = force,   force_j >= 0 where x_j is at its lower bound, <= 0 at its upper, 0 where it is free
//
// The problem solves q with some x_j fixed; two methods ask it to.
//   1. Primal-dual active set: fix what oversteps, free what pulls away from its bound, all at once; from the set of the last
//      step one or two rounds are the rule. It may cycle.    Hintermueller, Ito, Kunisch, SIAM J. Optim. 13 (2002), algorithm 1
//   2. Then the dual method, which cannot: from the free minimum, take the bound that is overstepped most; on the way to it,
//      drop whatever force would change its sign.
//                                     Goldfarb, Idnani, Math. Programming 27 (1983), with each step's end solved anew
// Both end in the same conditions, which are checked, so that a success is one. The number of rounds is bounded.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "common/types.hpp"

namespace slipstream {

enum class Side : std::int8_t { kLower = -1, kFree = 0, kUpper = 1 };

// P: bool solve(const Side*)            solves with these fixed; false if it cannot (not convex). What cannot be fixed besides
//                                    the others is left where it is, with a force that is out of all proportion
//    double value(int j), force(int j)   of the last solution
//    double lower(int j), upper(int j), slack(int j)   slack: by how much rounding may overstep
class ActiveSet {
 public:
  explicit ActiveSet(int most) : side_(static_cast<std::size_t>(most)), force_(side_.size()) {}

  Side& side(int j) { return side_[static_cast<std::size_t>(j)]; }
  Side side(int j) const { return side_[static_cast<std::size_t>(j)]; }
  void clear() { std::fill(side_.begin(), side_.end(), Side::kFree); }
  // The first `by` leave, and as many come in at `count`, free.
  void shift(int by, int count) {
    std::copy(side_.begin() + by, side_.begin() + count, side_.begin());
    std::fill(side_.begin() + (count - by), side_.end(), Side::kFree);
  }

  // count: of variables. Starts from the sides as they are, ends with those of the solution.
  template <typename P>
  bool solve(P& problem, int count) {
    for (int round = 0; round < kQuickRounds; ++round) {
      if (!problem.solve(side_.data())) break;
      if (!revise(problem, count)) {
        if (optimal(problem, count)) return true;
        break;
      }
    }
    return solve_dual(problem, count) && optimal(problem, count);
  }

 private:
  static constexpr int kQuickRounds = 6;

  static double overstep(double value, double lower, double upper) { return std::max(lower - value, value - upper); }

  // False: all is as it must be.
  template <typename P>
  bool revise(const P& problem, int count) {
    bool changed = false;
    for (int j = 0; j < count; ++j) {
      const Side now = side(j);
      Side next = Side::kFree;
      if (now == Side::kFree) {
        const double x = problem.value(j);
        if (problem.lower(j) - x > problem.slack(j)) next = Side::kLower;
        if (x - problem.upper(j) > problem.slack(j)) next = Side::kUpper;
      } else if (right(now, problem.force(j))) {
        next = now;
      }
      changed |= next != now;
      side(j) = next;
    }
    return changed;
  }
  // Bounds that depend on each other cannot always hold together, and rounding may have led either method astray.
  template <typename P>
  bool optimal(const P& problem, int count) const {
    for (int j = 0; j < count; ++j) {
      if (!(overstep(problem.value(j), problem.lower(j), problem.upper(j)) <= problem.slack(j))) return false;
      if (side(j) != Side::kFree && !right(side(j), problem.force(j))) return false;
    }
    return true;
  }
  static bool right(Side side, double force) { return side == Side::kLower ? force >= 0.0 : force <= 0.0; }

  template <typename P>
  bool solve_dual(P& problem, int count) {
    clear();
    std::fill(force_.begin(), force_.end(), 0.0);
    if (!problem.solve(side_.data())) return false;
    for (int rounds = 4 * count + 8; rounds > 0;) {
      int worst = -1;
      double most = 0.0;
      for (int j = 0; j < count; ++j) {
        const double over = overstep(problem.value(j), problem.lower(j), problem.upper(j)) / problem.slack(j);
        if (side(j) == Side::kFree && over > std::max(1.0, most)) most = over, worst = j;
      }
      if (worst < 0) return true;
      side(worst) = problem.value(worst) < problem.lower(worst) ? Side::kLower : Side::kUpper;
      for (bool arrived = false; !arrived; --rounds) {
        if (rounds == 0 || !problem.solve(side_.data())) return false;
        arrived = !step(problem, count, worst);
      }
    }
    return false;
  }
  // The forces move towards the solution's as far as none changes its sign; the one that would is freed. False: all the way.
  template <typename P>
  bool step(const P& problem, int count, int entering) {
    double part = 1.0;
    int leaving = -1;
    for (int j = 0; j < count; ++j) {
      if (side(j) == Side::kFree || j == entering || right(side(j), problem.force(j))) continue;
      const double now = force_[static_cast<std::size_t>(j)], t = now / (now - problem.force(j));
      if (leaving < 0 || t < part) part = t, leaving = j;
    }
    for (int j = 0; j < count; ++j) {
      double& force = force_[static_cast<std::size_t>(j)];
      force = side(j) == Side::kFree ? 0.0 : force + part * (problem.force(j) - force);
    }
    if (leaving < 0) return false;
    side(leaving) = Side::kFree;
    force_[static_cast<std::size_t>(leaving)] = 0.0;
    return true;
  }

  std::vector<Side> side_;
  std::vector<double> force_;
};

}  // namespace slipstream
