// The strapdown filters on the recorded CARLA drive against its truth, as document 001 runs them: started at truth without
// uncertainty, IMU in S = B, Q and R of the noise that the drive has. The bars are the README's figures of that folder for a
// plain error-state filter, and the issue's.
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "estimators/navigation.hpp"
#include "io/csv.hpp"

namespace slipstream::test {
namespace {

struct Fix {
  std::size_t row;  // of the IMU
  Vector3 z;
};
struct Drive {
  std::vector<double> t_s;
  std::vector<Inertial> imu;
  std::vector<Fix> gnss, lidar;        // the LIDAR's in its own map
  std::vector<NavigationState> truth;  // row k at t_s[k]; shorter than the IMU
};

std::vector<Vector3> triples(const CsvTable& t, const std::array<const char*, 3>& columns) {
  std::vector<Vector3> v(t.line.size());
  for (std::size_t i = 0; i < v.size(); ++i) v[i] = {t[columns[0]][i], t[columns[1]][i], t[columns[2]][i]};
  return v;
}

std::vector<Fix> fixes(const std::string& file, const std::array<const char*, 3>& columns,
                       const std::vector<double>& stamps_s) {
  const CsvTable t = read_csv(file, {"t_s", columns[0], columns[1], columns[2]}, "t_s");
  const std::vector<Vector3> z = triples(t, columns);
  std::vector<Fix> f;
  for (std::size_t i = 0, row = 0; i < z.size(); ++i) {
    while (row < stamps_s.size() && stamps_s[row] < t["t_s"][i] - 1e-6) ++row;  // all stamps coincide, to the file's digits
    if (row < stamps_s.size()) f.push_back({row, z[i]});
  }
  return f;
}

Drive read_drive(const std::string& folder) {
  const std::array<const char*, 3> f{"f_x_mps2", "f_y_mps2", "f_z_mps2"}, w{"w_x_radps", "w_y_radps", "w_z_radps"},
      p{"p_x_m", "p_y_m", "p_z_m"}, v{"v_x_mps", "v_y_mps", "v_z_mps"}, rpy{"roll_rad", "pitch_rad", "yaw_rad"};
  Drive d;
  const CsvTable imu = read_csv(folder + "/imu.csv", {"t_s", f[0], f[1], f[2], w[0], w[1], w[2]}, "t_s");
  d.t_s = imu["t_s"];
  const std::vector<Vector3> force = triples(imu, f), rate = triples(imu, w);
  for (std::size_t i = 0; i < force.size(); ++i) d.imu.push_back({force[i], rate[i]});
  d.gnss = fixes(folder + "/gnss.csv", p, d.t_s);
  d.lidar = fixes(folder + "/lidar.csv", {"l_x_m", "l_y_m", "l_z_m"}, d.t_s);
  const CsvTable truth = read_csv(folder + "/truth.csv", {p[0], p[1], p[2], v[0], v[1], v[2], rpy[0], rpy[1], rpy[2]});
  const std::vector<Vector3> at = triples(truth, p), speed = triples(truth, v), attitude = triples(truth, rpy);
  for (std::size_t i = 0; i < at.size(); ++i) {
    NavigationState x;
    x.p_WS = at[i];
    x.v_WS = speed[i];
    x.q_WS = from_rpy(attitude[i]);
    d.truth.push_back(x);
  }
  return d;
}

// Discrete variances, and where the LIDAR's map is believed to lie.
struct Belief {
  InertialNoise imu{0.001, 0.01, 0.0, 0.0};
  double gnss = 0.01, lidar = 0.25;
  Vector3 lidar_rpy_rad{0.05, 0.05, 0.1};
  bool use_gnss = true, use_lidar = true;
};
Belief starter() { return {{0.10, 0.25, 0.0, 0.0}, 0.01, 1.00}; }  // of the course's starter code

struct Score {
  double rmse_m = 0.0, nees = 0.0, nis_gnss = 0.0, nis_lidar = 0.0, largest_m = 0.0;
  Vector3 p_m = Vector3::Zero(), v_mps = Vector3::Zero(), rpy_deg = Vector3::Zero();  // RMSE per axis
  std::vector<Vector3> track;
};

Score run(const Drive& d, const NavigationFilter& filter, const Belief& belief) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  const Matrix3 c_li = from_rpy(belief.lidar_rpy_rad).toRotationMatrix();
  const Vector3 t_li(0.5, 0.1, 0.5);
  NavigationBelief b;
  b.x = d.truth.front();
  Score s;
  std::size_t gnss = 0, lidar = 0, fixes_gnss = 0, fixes_lidar = 0;
  for (std::size_t k = 1; k < d.imu.size(); ++k) {
    filter.predict(b, d.imu[k - 1], belief.imu, d.t_s[k] - d.t_s[k - 1]);
    NavigationMeasurement m;
    while (gnss < d.gnss.size() && d.gnss[gnss].row < k) ++gnss;
    if (belief.use_gnss && gnss < d.gnss.size() && d.gnss[gnss].row == k) {
      m.z = d.gnss[gnss].z;
      m.R = belief.gnss * Matrix3::Identity();
      s.nis_gnss += filter.update(b, m, kNever).nis;
      ++fixes_gnss;
    }
    while (lidar < d.lidar.size() && d.lidar[lidar].row < k) ++lidar;
    if (belief.use_lidar && lidar < d.lidar.size() && d.lidar[lidar].row == k) {
      m.z = c_li * d.lidar[lidar].z + t_li;
      m.R = belief.lidar * Matrix3::Identity();
      s.nis_lidar += filter.update(b, m, kNever).nis;
      ++fixes_lidar;
    }
    if (k >= d.truth.size()) continue;  // the sensors run on for 11 s without truth
    const Vector3 e = b.x.p_WS - d.truth[k].p_WS;
    s.p_m += e.cwiseAbs2();
    s.v_mps += (b.x.v_WS - d.truth[k].v_WS).cwiseAbs2();
    const Vector3 rpy = to_rpy(b.x.q_WS) - to_rpy(d.truth[k].q_WS);
    s.rpy_deg += rpy.unaryExpr(&wrap_angle).cwiseAbs2();
    s.largest_m = std::max(s.largest_m, e.cwiseAbs().maxCoeff());
    if (k > 1) s.nees += e.dot(b.P.topLeftCorner<3, 3>().inverse() * e);  // the first step tells the position no noise yet
    s.track.push_back(b.x.p_WS);
  }
  const double n = static_cast<double>(d.truth.size() - 1);
  s.rmse_m = std::sqrt(s.p_m.sum() / n);
  s.p_m = (s.p_m / n).cwiseSqrt();
  s.v_mps = (s.v_mps / n).cwiseSqrt();
  s.rpy_deg = (s.rpy_deg / n).cwiseSqrt() * 180.0 / kPi;
  s.nees /= n - 1.0;
  s.nis_gnss /= static_cast<double>(std::max<std::size_t>(fixes_gnss, 1));
  s.nis_lidar /= static_cast<double>(std::max<std::size_t>(fixes_lidar, 1));
  return s;
}

StrapdownTuning tuning(const std::string& error, bool biases) {
  StrapdownTuning t;
  t.orientation_error = error;
  t.biases = biases;
  return t;
}

class NavigationAccuracy : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::string data = SLIPSTREAM_DATA_DIR;
    if (data.empty()) GTEST_SKIP() << "no recorded drives: configure with -DSLIPSTREAM_DATA=...";
    drive_ = read_drive(data + "/coursera_carla_pt1");
  }
  Score document(const Belief& belief) const { return run(drive_, *make_es_ekf({}, tuning("global", false)), belief); }
  Drive drive_;
};

constexpr double kReadme_m = 0.005;  // the issue: the document's form within 5 mm of the figures attained

TEST_F(NavigationAccuracy, ImuAndGnss) {
  Belief b;
  b.use_lidar = false;
  const Score s = document(b);
  EXPECT_LE(s.rmse_m, 0.200);  // the bar
  EXPECT_NEAR(s.rmse_m, 0.195, kReadme_m);
  EXPECT_LT((s.p_m - Vector3(0.125, 0.122, 0.086)).cwiseAbs().maxCoeff(), kReadme_m);
}

TEST_F(NavigationAccuracy, ImuGnssAndLidar) {
  const Score s = document({});
  EXPECT_LE(s.rmse_m, 0.180);  // the bar
  EXPECT_NEAR(s.rmse_m, 0.177, kReadme_m);
  EXPECT_LT((s.p_m - Vector3(0.115, 0.115, 0.070)).cwiseAbs().maxCoeff(), kReadme_m);
  EXPECT_LT((s.v_mps - Vector3(0.155, 0.126, 0.058)).cwiseAbs().maxCoeff(), 0.005);  // the README's last digit is 0.001
  EXPECT_LT((s.rpy_deg - Vector3(0.60, 0.60, 0.72)).cwiseAbs().maxCoeff(), 0.05);    // its last digit is 0.01
  EXPECT_GE(s.nees, 2.4);                                                            // the bars
  EXPECT_LE(s.nees, 3.6);
  EXPECT_NEAR(s.nees, 2.9, 0.1);  // its digits
  EXPECT_NEAR(s.nis_gnss, 2.9, 0.1);
  EXPECT_NEAR(s.nis_lidar, 3.0, 0.1);
}

TEST_F(NavigationAccuracy, VariancesOfTheStarterCode) {
  Belief b = starter();
  EXPECT_NEAR(document(b).rmse_m, 0.225, kReadme_m);
  b.use_lidar = false;
  EXPECT_NEAR(document(b).rmse_m, 0.260, kReadme_m);
}

TEST_F(NavigationAccuracy, LidarAloneAndNothing) {
  Belief b;
  b.use_gnss = false;
  EXPECT_NEAR(document(b).rmse_m, 0.296, kReadme_m);
  b.use_lidar = false;
  const Score s = document(b);
  EXPECT_NEAR(s.rmse_m, 92.0, 0.5);  // the README's digits
  EXPECT_NEAR(s.largest_m, 186.0, 0.5);
}

TEST_F(NavigationAccuracy, AWrongMountingAngleShows) {
  Belief b;
  b.lidar_rpy_rad = {0.05, 0.05, 0.05};
  const Score s = document(b);
  EXPECT_NEAR(s.rmse_m, 2.25, 0.01);  // the README's digits
  EXPECT_NEAR(s.nis_gnss, 500.0, 50.0);
  b.lidar = 100.0;
  EXPECT_LE(document(b).rmse_m, 0.29);  // the README's; it is less here: 0.193, as good as without the LIDAR
}

TEST_F(NavigationAccuracy, EveryFormAgrees) {
  const Score document_form = document({});
  const double with_biases = run(drive_, *make_es_ekf({}, tuning("global", true)), {}).rmse_m;
  EXPECT_NEAR(with_biases, document_form.rmse_m, 1e-9);  // biases known to be zero: the same filter but for rounding
  for (const bool biases : {false, true}) {
    const Score local = run(drive_, *make_es_ekf({}, tuning("local", biases)), {});
    EXPECT_NEAR(local.rmse_m, document_form.rmse_m, 0.001);  // the README
  }
}

// The rival: to second order the same, and on this drive the second order is small.
TEST_F(NavigationAccuracy, UnscentedFilter) {
  const Score ekf = document({});
  for (const char* error : {"global", "local"}) {
    const Score s = run(drive_, *make_navigation_ukf({}, tuning(error, false)), {});
    EXPECT_LE(s.rmse_m, 0.180);  // the bar for the error-state filter
    EXPECT_NEAR(s.rmse_m, ekf.rmse_m,
                kReadme_m);  // attitude is known to 1 degree: second order is 1e-4 of the velocity's change
    EXPECT_GE(s.nees, 2.4);
    EXPECT_LE(s.nees, 3.6);
  }
}

}  // namespace
}  // namespace slipstream::test
