// A car that follows a road in three dimensions, kinematically: speed over time; curvature, grade, bank and bumps over
// distance.
//
//   s' = v(t),   psi' = kappa(s) v,   u = grade(s) + h'(s),   e = (cos psi c, sin psi c, u),   c = sqrt(1 - u^2),   p' = v e
//   attitude: yaw psi, pitch theta = -asin(u), roll phi = bank(s);   v_WB = v e: it moves along its own x axis, without slip
//
// State: p (east, north, up), psi, s, t: only these are integrated. All else is their function, so that acceleration, angular
// rate and angular acceleration are exact derivatives of the path, and continuous (parts/smooth_profile.hpp says how smooth the
// profiles are):
//
//   a = v' e + v e',   e' = psi' (-e_y, e_x, 0) - theta' (-cos psi u, -sin psi u, c)
//   w = (phi' - psi' sin theta,  theta' cos phi + psi' cos theta sin phi,  -theta' sin phi + psi' cos theta cos phi)
//   alpha = w';  d/dt = v d/ds,  d2/dt2 = v^2 d2/ds2 + v' d/ds;  theta_s = -u_s / c,  theta_ss = -(u_ss + u u_s^2 / c^2) / c
//
// W is east-north-up, B forward-left-up; the reference point is on the path. Distance s is along the path, grade = up per metre
// of it (nose up is negative pitch), curvature = yaw per metre of it, positive to the left; positive bank lifts the left side.
// There is no suspension and no wheelbase: bumps shorter than a car are felt as by a single wheel. Forwards only, |u| at most
// 0.7. Mode: how many points of the profiles are past; each is an event, so that no integration step leaps over one.
#pragma once

#include <cmath>
#include <vector>

#include "common/parameters.hpp"
#include "models/parts/smooth_profile.hpp"
#include "models/parts/timetable.hpp"
#include "models/rigid_motion.hpp"
#include "models/vehicle.hpp"

namespace slipstream {

struct RoadCar {
  static constexpr std::string_view kName = "road_car";
  static constexpr int kStates = 6;
  static constexpr int kEvents = 2;
  static constexpr std::array<Crossing, kEvents> kCrossings{Crossing::kRising, Crossing::kRising};
  static constexpr std::array<Quantity, 10> kTruth{{{"east_m", "m"},
                                                    {"north_m", "m"},
                                                    {"up_m", "m"},
                                                    {"v_east_mps", "m/s"},
                                                    {"v_north_mps", "m/s"},
                                                    {"v_up_mps", "m/s"},
                                                    {"roll_rad", "rad"},
                                                    {"pitch_rad", "rad"},
                                                    {"yaw_rad", "rad"},
                                                    {"forward_speed_mps", "m/s"}}};
  static constexpr std::array<Quantity, 0> kInputs{};
  using State = Vector<double, kStates>;
  struct Mode {
    TimePoints::Mode time = 0, distance = 0;
  };

  std::vector<double> speed_time_s{1.0, 6.0};  // pulls away
  std::vector<double> speed_mps{0.0, 10.0};
  std::vector<double> curvature_distance_m, curvature_radpm;
  std::vector<double> grade_distance_m, grade;
  std::vector<double> bank_distance_m, bank_rad;
  Bumps bumps;
  Vector3 initial_position_m{0.0, 0.0, 0.0};
  double initial_yaw_rad = 0.0;

  template <typename Self, typename V>
  static void visit_parameters(Self& p, V& v) {
    v.list("speed_time_s", p.speed_time_s, non_negative());
    v.list("speed_mps", p.speed_mps, between(0.0, 200.0));
    v.list("curvature_distance_m", p.curvature_distance_m, non_negative());
    v.list("curvature_radpm", p.curvature_radpm, between(-1.0, 1.0));
    v.list("grade_distance_m", p.grade_distance_m, non_negative());
    v.list("grade", p.grade, between(-kSteepest, kSteepest));
    v.list("bank_distance_m", p.bank_distance_m, non_negative());
    v.list("bank_rad", p.bank_rad, between(-1.0, 1.0));
    v.list("bump_position_m", p.bumps.position_m, non_negative());
    v.list("bump_length_m", p.bumps.length_m, positive());
    v.list("bump_height_m", p.bumps.height_m, between(-10.0, 10.0));
    v.triple("initial_position_m", p.initial_position_m, between(-1e6, 1e6));
    v.number("initial_yaw_rad", p.initial_yaw_rad, between(-2.0 * kPi, 2.0 * kPi));
  }

  // Derived from the parameters; call once after they are set. Refuses lists that do not fit together.
  void prepare() {
    if (speed_time_s.empty()) throw Refusal("vehicle.speed_time_s: is empty, expected at least one time");
    require_profile("speed_time_s", speed_time_s, "speed_mps", speed_mps);
    require_profile("curvature_distance_m", curvature_distance_m, "curvature_radpm", curvature_radpm);
    require_profile("grade_distance_m", grade_distance_m, "grade", grade);
    require_profile("bank_distance_m", bank_distance_m, "bank_rad", bank_rad);
    require_profile("bump_position_m", bumps.position_m, "bump_length_m", bumps.length_m);
    require_profile("bump_position_m", bumps.position_m, "bump_height_m", bumps.height_m);
    for (std::size_t i = 1; i < bumps.position_m.size(); ++i)
      if (bumps.position_m[i - 1] + bumps.length_m[i - 1] > bumps.position_m[i])
        throw Refusal("vehicle.bump_length_m: the bump at " + std::to_string(bumps.position_m[i - 1]) +
                      " m reaches into the one at " + std::to_string(bumps.position_m[i]) +
                      " m, expected one behind the other");
    double steepest = 0.0;
    for (const double g : grade) steepest = std::max(steepest, std::abs(g));
    if (steepest + bumps.steepest() > kSteepest)
      throw Refusal("vehicle.bump_height_m: the steepest bump on the steepest grade climbs " +
                    std::to_string(steepest + bumps.steepest()) + " per metre of the path, expected at most 0.7");
    std::vector<double> distance_m = bumps.position_m;
    for (std::size_t i = 0; i < bumps.position_m.size(); ++i) distance_m.push_back(bumps.position_m[i] + bumps.length_m[i]);
    for (const auto* more : {&curvature_distance_m, &grade_distance_m, &bank_distance_m})
      distance_m.insert(distance_m.end(), more->begin(), more->end());
    times_ = TimePoints(speed_time_s);
    distances_ = TimePoints(distance_m);
  }

  State initial_state() const {
    State x;
    x << initial_position_m, initial_yaw_rad, 0.0, 0.0;
    return x;
  }
  Mode initial_mode() const { return {times_.at_start(), distances_.at_start()}; }

  template <typename T>
  Vector<T, kStates> derivative(const Vector<T, kStates>& x, const Mode&) const {
    using std::cos, std::sin, std::sqrt;
    const T &psi = x[3], &s = x[4], &t = x[5];
    const T v = smooth_profile(t, speed_time_s, speed_mps).y;
    const T u = climb(s).y, level = v * sqrt(1.0 - u * u);
    Vector<T, kStates> rate;
    rate << level * cos(psi), level * sin(psi), v * u, v * smooth_profile(s, curvature_distance_m, curvature_radpm).y, v,
        T(1.0);
    return rate;
  }

  Vector<double, kEvents> events(const State& x, const Mode& mode) const {
    return {times_.event(x[5], mode.time), distances_.event(x[4], mode.distance)};
  }
  Mode after_event(int event, const State&, Mode mode) const {
    return event == 0 ? Mode{times_.after(mode.time), mode.distance} : Mode{mode.time, distances_.after(mode.distance)};
  }

  RigidMotion motion(const State& x, const Mode&) const {
    const double psi = x[3], s = x[4];
    const auto speed = smooth_profile(x[5], speed_time_s, speed_mps);
    const double v = speed.y, a = speed.first;
    const auto kappa = smooth_profile(s, curvature_distance_m, curvature_radpm);
    const auto bank = smooth_profile(s, bank_distance_m, bank_rad);
    const auto u = climb(s);
    const double c2 = 1.0 - u.y * u.y, c = std::sqrt(c2);
    const double theta = -std::asin(u.y), theta_s = -u.first / c, theta_ss = -(u.second + u.y * u.first * u.first / c2) / c;

    const double psi_1 = kappa.y * v, psi_2 = kappa.first * v * v + kappa.y * a;
    const double theta_1 = theta_s * v, theta_2 = theta_ss * v * v + theta_s * a;
    const double phi_1 = bank.first * v, phi_2 = bank.second * v * v + bank.first * a;

    const Vector3 e(std::cos(psi) * c, std::sin(psi) * c, u.y);
    const Vector3 e_1 = psi_1 * Vector3(-e[1], e[0], 0.0) - theta_1 * Vector3(-std::cos(psi) * u.y, -std::sin(psi) * u.y, c);
    const double sr = std::sin(bank.y), cr = std::cos(bank.y), sp = std::sin(theta), cp = std::cos(theta);
    RigidMotion m;
    m.p_WB = x.head<3>();
    m.v_WB = v * e;
    m.a_WB = a * e + v * e_1;
    m.q_WB = from_rpy({bank.y, theta, psi});
    m.w_WB_B = {phi_1 - psi_1 * sp, theta_1 * cr + psi_1 * cp * sr, -theta_1 * sr + psi_1 * cp * cr};
    const double level_1 = psi_2 * cp - psi_1 * theta_1 * sp;  // of psi' cos theta
    m.alpha_WB_B = {phi_2 - psi_2 * sp - psi_1 * theta_1 * cp,
                    theta_2 * cr - theta_1 * phi_1 * sr + level_1 * sr + psi_1 * cp * phi_1 * cr,
                    -theta_2 * sr - theta_1 * phi_1 * cr + level_1 * cr - psi_1 * cp * phi_1 * sr};
    return m;
  }

  std::array<double, kInputs.size()> inputs(const State&, const Mode&) const { return {}; }

  std::array<double, kTruth.size()> truth(const State& x, const Mode& mode) const {
    const RigidMotion m = motion(x, mode);
    const double roll = smooth_profile(x[4], bank_distance_m, bank_rad).y, pitch = -std::asin(climb(x[4]).y);
    return {m.p_WB[0], m.p_WB[1], m.p_WB[2], m.v_WB[0],        m.v_WB[1],
            m.v_WB[2], roll,      pitch,     wrap_angle(x[3]), smooth_profile(x[5], speed_time_s, speed_mps).y};
  }

 private:
  static constexpr double kSteepest = 0.7;

  // u(s), u_s, u_ss.
  template <typename T>
  Derivatives<T> climb(const T& s) const {
    const Derivatives<T> road = smooth_profile(s, grade_distance_m, grade), bump = bumps.slope(s);
    return {road.y + bump.y, road.first + bump.first, road.second + bump.second};
  }

  TimePoints times_, distances_;  // of the speed; of all else
};

static_assert(MovingVehicle<RoadCar>);

}  // namespace slipstream
