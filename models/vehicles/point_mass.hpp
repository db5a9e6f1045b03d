// A car in the plane as a point mass that a timetable drives.
//
//   (x_e, x_n, v, theta)' as in parts/point_mass_car.hpp,   t' = 1                                   (document 000, eq. 1)
//
// State: x_e, x_n, v, theta, t. Mode: how many points of the timetables of accelerator and steering are past; each is an event.
// Both are linear between their points, constant before the first and after the last. Its random disturbances are the plant's
// (models/scenario.hpp, process_noise): document 000 disturbs the positions once a sample, by T w_k (eqs 4 and 21).
#pragma once

#include <utility>
#include <vector>

#include "models/parts/point_mass_car.hpp"
#include "models/parts/timetable.hpp"
#include "models/vehicle.hpp"

namespace slipstream {

struct PointMass {
  static constexpr std::string_view kName = "point_mass";
  static constexpr int kStates = 5;
  static constexpr int kEvents = 1;
  static constexpr std::array<std::string_view, kStates> kStateNames{"east_m", "north_m", "speed_mps", "heading_rad", ""};
  static constexpr std::array<bool, kStates> kIgnorable{true, true, false, false, false};
  static constexpr std::array<Crossing, kEvents> kCrossings{Crossing::kRising};
  static constexpr std::array<Quantity, 7> kTruth{{{"east_m", "m"},
                                                   {"north_m", "m"},
                                                   {"speed_mps", "m/s"},
                                                   {"heading_rad", "rad"},
                                                   {"forward_speed_mps", "m/s"},
                                                   {"accelerator", "1"},
                                                   {"steering_angle_rad", "rad"}}};
  static constexpr std::array<Quantity, 2> kInputs{{{"accelerator", "1"}, {"steering_angle_rad", "rad"}}};
  using Mode = TimePoints::Mode;
  using State = Vector<double, kStates>;

  PointMassCar car;
  std::vector<double> accelerator_time_s{0.0};
  std::vector<double> accelerator{0.5};
  std::vector<double> steering_time_s{0.0};
  std::vector<double> steering_rad{0.01};
  double initial_east_m = 0.0;
  double initial_north_m = 0.0;
  double initial_speed_mps = 20.0;
  double initial_heading_rad = 0.0;

  template <typename Self, typename V>
  static void visit_parameters(Self& p, V& v) {
    PointMassCar::visit_parameters(p.car, v);
    v.list("accelerator_time_s", p.accelerator_time_s, non_negative());
    v.list("accelerator", p.accelerator, between(0.0, 1.0));
    v.list("steering_time_s", p.steering_time_s, non_negative());
    v.list("steering_rad", p.steering_rad, between(-1.5, 1.5));
    v.number("initial_east_m", p.initial_east_m, any_number());
    v.number("initial_north_m", p.initial_north_m, any_number());
    v.number("initial_speed_mps", p.initial_speed_mps, any_number());
    v.number("initial_heading_rad", p.initial_heading_rad, any_number());
  }

  // Derived from the parameters; call once after they are set. Refuses lists that do not fit together.
  void prepare() {
    require_timetable("accelerator_time_s", accelerator_time_s, "accelerator", accelerator);
    require_timetable("steering_time_s", steering_time_s, "steering_rad", steering_rad);
    std::vector<double> points_s = accelerator_time_s;
    points_s.insert(points_s.end(), steering_time_s.begin(), steering_time_s.end());
    points_ = TimePoints(std::move(points_s));
    accelerator_.clear();
    steering_.clear();
    for (Mode mode = 0; mode < points_.modes(); ++mode) {
      accelerator_.push_back(timetable_line(points_.begin_s(mode), accelerator_time_s, accelerator));
      steering_.push_back(timetable_line(points_.begin_s(mode), steering_time_s, steering_rad));
    }
  }

  State initial_state() const {
    State x;
    x << initial_east_m, initial_north_m, initial_speed_mps, initial_heading_rad, 0.0;
    return x;
  }
  Mode initial_mode() const { return points_.at_start(); }

  template <typename T>
  Vector<T, kStates> derivative(const Vector<T, kStates>& x, const Mode& mode) const {
    using std::tan;
    const T tangent = tan(steering_[mode].at(x[4]));
    const Vector<T, 4> rate = car.derivative(x[2], x[3], accelerator_[mode].at(x[4]), tangent);
    Vector<T, kStates> all;
    all << rate[0], rate[1], rate[2], rate[3], T(1.0);
    return all;
  }

  Vector<double, kEvents> events(const State& x, const Mode& mode) const {
    return Vector<double, kEvents>(points_.event(x[4], mode));
  }
  Mode after_event(int, const State&, Mode mode) const { return points_.after(mode); }

  std::array<double, kInputs.size()> inputs(const State& x, const Mode& mode) const {
    return {accelerator_[mode].at(x[4]), steering_[mode].at(x[4])};
  }
  std::array<double, kTruth.size()> truth(const State& x, const Mode& mode) const {
    const auto u = inputs(x, mode);
    return {x[0], x[1], x[2], x[3], x[2], u[0], u[1]};
  }

 private:
  TimePoints points_;                                  // of both timetables
  std::vector<TimetableLine> accelerator_, steering_;  // one per mode
};

static_assert(Vehicle<PointMass>);

}  // namespace slipstream
