// What becomes of the bound in scores.json, tables, report and figures.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "models/scenario.hpp"
#include "monitor/gnuplot.hpp"
#include "monitor/live_table.hpp"
#include "monitor/tables.hpp"
#include "tests/monitor/fixture.hpp"

namespace slipstream {
namespace {

using Json = nlohmann::json;

constexpr double kQ = 0.04, kR = 0.25;

// A car that is known to stand and whose position is pushed to the east: the bound of that is a scalar recursion.
class StandingCar : public TestRun {
 public:
  StandingCar() {
    Scenario s;
    s.plant.vehicle = PointMass();
    s.plant.truth_rate_hz = 10.0;
    s.plant.process_noise_rate_hz = 10.0;
    s.plant.process_noise = {{"east_m", std::sqrt(kQ)}};
    s.sensors = {{"east_position", "east_m", 10.0, {0.0, std::sqrt(kR)}}};
    s.estimator.process = PointMassMotion();
    scenario = std::make_shared<const Scenario>(s);
    descriptor.truth_names.clear();
    descriptor.truth_units.clear();
    for (const Quantity& q : PointMass::kTruth) {
      descriptor.truth_names.emplace_back(q.name);
      descriptor.truth_units.emplace_back(q.unit);
    }
    announcement.state_names = {"east_m", "friction"};
    announcement.state_units = {"m", "1"};
  }

  // Ten instants: east is 3 m, the errors are +0.5 m and -0.5 m in turn.
  void play() {
    session.handle(descriptor);
    session.handle(announcement);
    for (int i = 0; i < 10; ++i) {
      session.handle(Truth{header(i), {3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0}});
      Estimate m = estimate(i, 0.0);
      m.mean = {i % 2 == 0 ? 3.5 : 2.5, 0.5};
      session.handle(m);
      session.handle(Tick{header(i), i == 9 ? RunState::kEnded : RunState::kRunning});
    }
  }
};

// The mean over those instants of P, P = 1/(1/(P + q) + 1/r), P = 0 at the first.
double mean_variance() {
  double P = 0.0, sum = 0.0;
  for (int i = 1; i < 10; ++i) {
    P = 1.0 / (1.0 / (P + kQ) + 1.0 / kR);
    sum += P;
  }
  return sum / 10.0;
}

TEST(BoundResults, AreScored) {
  StandingCar t;
  t.play();
  const TestResults r(t.session);
  const Json j = Json::parse(scores_json(r.results));
  EXPECT_EQ(j["bound"]["applies"], true);
  EXPECT_TRUE(j["bound"]["why_not"].is_null());
  const double rmse_bound = std::sqrt(mean_variance());
  EXPECT_NEAR(j["bound"]["states"]["east_m"]["rmse_bound"].get<double>(), rmse_bound, 1e-12);  // rounding
  EXPECT_EQ(j["bound"]["states"]["heading_rad"]["rmse_bound"], 0.0);                           // known, and not pushed
  const Json& states = j["estimators"]["ekf"]["states"];
  EXPECT_NEAR(states["east_m"]["rmse_bound"].get<double>(), rmse_bound, 1e-12);
  EXPECT_NEAR(states["east_m"]["efficiency"].get<double>(), mean_variance() / 0.25, 1e-12);
  EXPECT_TRUE(states["friction"]["efficiency"].is_null());
}

TEST(BoundResults, AreAColumnOfTheAccuracyTable) {
  StandingCar t;
  t.play();
  const TestResults r(t.session);
  const Table table = accuracy_table(r.results);
  EXPECT_EQ(table.columns.back().title, "efficiency");
  EXPECT_EQ(table.rows[0].back(), "0.257");  // by hand: the mean variance is 0.06437, over 0.25
  EXPECT_EQ(table.rows[1].back(), "-");
  EXPECT_EQ(no_bound_text(r.board), "");
  std::istringstream lines(scoreboard_text(r.results));
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 100u);
}

TEST(BoundResults, AreDrawnAndExplained) {
  StandingCar t;
  t.play();
  const TestResults r(t.session);
  const std::string html = report_html(r.results, true);
  EXPECT_NE(html.find("Efficiency: the posterior Cramer-Rao bound over the mean squared error"), std::string::npos);
  EXPECT_EQ(html.find("No bound"), std::string::npos);
  if (!draw("print 1").installed) GTEST_SKIP() << "no gnuplot";
  EXPECT_NE(html.find("bound (1 sigma)"), std::string::npos);
  EXPECT_NE(html.find("Dashed: one standard deviation of the posterior Cramer-Rao bound"), std::string::npos);
  EXPECT_EQ(html.find("could not be drawn"), std::string::npos);
}

TEST(BoundResults, SayWhyThereIsNone) {
  StandingCar t;
  Scenario other = *t.scenario;
  other.plant.vehicle = Unimog();
  t.scenario = std::make_shared<const Scenario>(other);
  t.play();
  const TestResults r(t.session);
  const std::string reason =
      "the model 'point_mass_motion' is not what the plant 'unimog' does, whose own equations the bound needs";
  EXPECT_EQ(no_bound_text(r.board), "No bound: " + reason + ".");
  EXPECT_NE(accuracy_table(r.results).columns.back().title, "efficiency");
  EXPECT_EQ(Json::parse(scores_json(r.results))["bound"]["why_not"], reason);
  const std::string html = report_html(r.results, true);
  EXPECT_NE(html.find("<p>No bound: the model &#39;point_mass_motion&#39; is not what"), std::string::npos);
  EXPECT_EQ(html.find("Efficiency"), std::string::npos);
  EXPECT_EQ(html.find("bound (1 sigma)"), std::string::npos);
  EXPECT_NE(scoreboard_text(r.results).find("\nNo bound: the model 'point_mass_motion' is not what"), std::string::npos);
}

// Errors 1, 2 and unknown, variances 1, 4, 9: (1 + 4)/(1 + 4) and sqrt(5/2).
TEST(BoundResults, OnlyWhatIsKnownIsScored) {
  const double nan = std::nan("");
  const BoundScore s =
      score_bound(std::vector{0.0, 0.0, 0.0, 0.0}, std::vector{1.0, -2.0, nan, 5.0}, std::vector{1.0, 4.0, 9.0, nan});
  EXPECT_DOUBLE_EQ(s.efficiency, 1.0);
  EXPECT_DOUBLE_EQ(s.rmse_bound, std::sqrt(2.5));
  EXPECT_TRUE(std::isnan(score_bound(std::vector{1.0}, std::vector{1.0}, std::vector{1.0}).efficiency)) << "no error at all";
  EXPECT_TRUE(std::isnan(score_bound({}, {}, {}).rmse_bound));
}

}  // namespace
}  // namespace slipstream
