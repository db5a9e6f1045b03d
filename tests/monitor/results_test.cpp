#include "monitor/results.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/refusal.hpp"
#include "monitor/gnuplot.hpp"
#include "monitor/live_table.hpp"
#include "monitor/plot_script.hpp"
#include "monitor/tables.hpp"
#include "monitor/text.hpp"
#include "tests/monitor/fixture.hpp"

namespace slipstream {
namespace {

using Json = nlohmann::json;

class Folder {
 public:
  Folder() : path_(std::filesystem::temp_directory_path() / ("slipstream_results_test_" + std::to_string(::getpid()))) {
    std::filesystem::create_directories(path_);
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  std::string path(const std::string& name = "") const { return name.empty() ? path_.string() : (path_ / name).string(); }
  std::string text(const std::string& name) const {
    std::ifstream file(path(name));
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
  }

 private:
  std::filesystem::path path_;
};

TEST(ScoresJson, KeepsItsContract) {
  TestRun t;
  t.complete();
  const TestResults r(t.session);
  const Json j = Json::parse(scores_json(r.results));
  EXPECT_EQ(j["run"]["id"], "test-3");
  EXPECT_EQ(j["run"]["scenario"], "test");
  EXPECT_EQ(j["run"]["seed"], 3);
  EXPECT_EQ(j["run"]["duration_s"], 1.0);
  EXPECT_EQ(j["run"]["complete"], true);
  EXPECT_EQ(j["run"]["clock"], "lockstep");
  EXPECT_EQ(j["run"]["times"]["realtime_factor"], 0.5);  // 1 s simulated in 2 s
  const Json& e = j["estimators"]["ekf"];
  EXPECT_EQ(e["algorithm"], "ekf");
  EXPECT_EQ(e["tuning"], "matched");
  EXPECT_EQ(e["model"], "point");
  // Errors of +-1 on t = 0, 0.1 ... 1: SS_res = 11, SS_tot = 0.01 (11^3 - 11)/12 = 1.1.
  EXPECT_NEAR(e["states"]["speed_mps"]["rmse"].get<double>(), 1.0, 1e-12);  // rounding of t + 1 - t
  EXPECT_NEAR(e["states"]["speed_mps"]["r2"].get<double>(), -9.0, 1e-12);   // the same
  EXPECT_NEAR(e["states"]["speed_mps"]["max_abs_error"].get<double>(), 1.0, 1e-12);
  EXPECT_EQ(e["states"]["friction"]["rmse"], 0.0);
  EXPECT_TRUE(e["states"]["friction"]["r2"].is_null());  // constant truth
  EXPECT_EQ(j["bound"]["applies"], false);
  EXPECT_EQ(j["bound"]["why_not"], "the scenario is not known");
  EXPECT_TRUE(j["bound"]["states"].empty());
  for (const char* key : {"rmse_bound", "efficiency"}) EXPECT_TRUE(e["states"]["speed_mps"].at(key).is_null()) << key;
  EXPECT_DOUBLE_EQ(e["nees_mean"].get<double>(), 0.25);
  EXPECT_DOUBLE_EQ(e["nis_mean"].get<double>(), 1.0);
  EXPECT_EQ(e["step_time_us"]["p50"], 105.0);
  EXPECT_EQ(e["step_time_us"]["p99"], 110.0);
  EXPECT_EQ(e["step_time_us"]["max"], 110.0);
  for (const char* key : {"deadline_misses", "messages_lost", "late", "out_of_order", "rejected"}) EXPECT_EQ(e[key], 0) << key;
}

TEST(ScoresJson, KktResidualsAreThoseOfWhoSolvesPrograms) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const auto scored = [](std::initializer_list<double> residuals) {
    TestRun t;
    t.session.handle(t.descriptor);
    t.session.handle(t.announcement);
    int i = 0;
    for (const double residual : residuals) {
      Estimate e = t.estimate(i++, 0.0);
      e.kkt_residual = residual;
      t.session.handle(e);
    }
    const TestResults r(t.session);
    return Json::parse(scores_json(r.results))["estimators"]["ekf"];
  };
  EXPECT_FALSE(scored({-1.0, -1.0}).contains("kkt_residual"));  // solves none
  EXPECT_FALSE(scored({kNan, kNan}).contains("kkt_residual"));  // found none
  const Json some = scored({1e-3, kNan, 3e-3, 2e-3})["kkt_residual"];
  EXPECT_EQ(some["programs"], 3);
  EXPECT_EQ(some["p50"], 2e-3);
  EXPECT_EQ(some["max"], 3e-3);
}

TEST(ScoresJson, UnknownIsNullAndNothingIsNotFinite) {
  TestRun t;
  t.descriptor.truth_names = {"other", "another"};
  t.session.handle(t.descriptor);
  t.session.handle(t.announcement);
  Estimate bad = t.estimate(0, 0.0);
  bad.mean[0] = std::numeric_limits<double>::infinity();
  bad.covariance[0] = std::numeric_limits<double>::quiet_NaN();
  bad.step_time_us = std::numeric_limits<double>::quiet_NaN();
  t.session.handle(bad);
  const TestResults r(t.session);
  const Json j = Json::parse(scores_json(r.results));
  EXPECT_EQ(j["run"]["complete"], false);
  const Json& e = j["estimators"]["ekf"];
  EXPECT_EQ(e["invalid"], 1);
  EXPECT_TRUE(e["states"]["speed_mps"]["rmse"].is_null());
  EXPECT_TRUE(e["nees_mean"].is_null());
  EXPECT_TRUE(e["nis_mean"].is_null());
  EXPECT_TRUE(e["step_time_us"]["p50"].is_null());
}

TEST(ScoresJson, SameRunSameBytesApartFromTimes) {
  const auto without_times = [](double slower) {
    TestRun t;
    t.session.handle(t.descriptor);
    t.session.handle(t.announcement);
    for (int i = 0; i < 5; ++i) {
      Estimate m = t.estimate(i, 0.3);
      m.step_time_us *= slower;
      t.session.handle(Truth{TestRun::header(i), {0.1 * i, 0.5}});
      t.session.handle(m);
      t.session.handle(Tick{TestRun::header(i), RunState::kRunning});
    }
    TestResults r(t.session);
    r.times.wall_s *= slower;
    Json j = Json::parse(scores_json(r.results));
    j["run"].erase("times");
    j["estimators"]["ekf"].erase("step_time_us");
    j["estimators"]["ekf"].erase("deadline_misses");
    return j.dump();
  };
  EXPECT_EQ(without_times(1.0), without_times(1000.0));
}

TEST(SeriesCsv, OneRowAnInstantAndEmptyCells) {
  TestRun t;
  t.session.handle(t.descriptor);
  t.session.handle(t.announcement);
  t.session.handle(Reading{TestRun::header(0), "speed_mps", 0.1});
  t.session.handle(Truth{TestRun::header(1), {1.5, std::numeric_limits<double>::quiet_NaN()}});
  Estimate m = t.estimate(1, 0.0);
  m.mean = {0.5, 0.25};
  t.session.handle(m);
  const TestResults r(t.session);
  const Folder folder;
  write_series_csv(folder.path("s.csv"), r.results);
  EXPECT_EQ(folder.text("s.csv"),
            "t_s,truth_speed_mps,truth_friction,measured_speed_mps,ekf.speed_mps,ekf.speed_mps.sigma,ekf.friction,"
            "ekf.friction.sigma,ekf.status,ekf.nees,ekf.nis,ekf.step_time_us\n"
            "0.000000,,,0.10000000000000001,,,,,,,,\n"
            "0.100000,1.5,,,0.5,2,0.25,1,0,0.25,0,101\n");
  EXPECT_FALSE(std::filesystem::exists(folder.path("s.csv.partial")));
}

TEST(Results, AreWrittenWholeOrNotAtAll) {
  TestRun t;
  t.complete();
  const TestResults r(t.session);
  const Folder folder;
  write_results(folder.path(), r.results, false);
  for (const char* name : {"scores.json", "series.csv", "report.html", "scenario.toml"})
    EXPECT_TRUE(std::filesystem::exists(folder.path(name))) << name;
  EXPECT_EQ(folder.text("scenario.toml"), "name = \"test\"\n");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 4);  // no temporary file stays
  remove_results(folder.path());
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  try {
    write_file("/nowhere/x.json", "x");
    FAIL();
  } catch (const Refusal& refusal) {
    EXPECT_STREQ(refusal.what(), "/nowhere/x.json: cannot be written: No such file or directory");
  }
}

TEST(Report, IsSelfContainedAndShowsPublishedValues) {
  TestRun t;
  t.complete();
  Published p;
  p.title = "A table";
  p.notes = {"Their P is fixed."};
  p.rows.push_back({"ekf", "document", "speed_mps", "r2", "a document", 5.0, 0.9639});
  const TestResults r(t.session, p);
  const std::string html = report_html(r.results, true);
  for (const char* external : {"http:", "https:", "src=", "@import", "<script", "<link", "file:"})
    EXPECT_EQ(html.find(external), std::string::npos) << external;
  EXPECT_NE(html.find("0.9639 (document)"), std::string::npos);
  EXPECT_NE(html.find("<li>Their P is fixed.</li>"), std::string::npos);
  if (draw("print 1").installed) {
    EXPECT_NE(html.find("<svg role=\"img\" aria-label=\"speed. Above: value."), std::string::npos);
    EXPECT_NE(html.find("time (s)"), std::string::npos);
    EXPECT_NE(html.find("friction (-)"), std::string::npos);
    EXPECT_EQ(html.find("could not be drawn"), std::string::npos);
  }
  EXPECT_EQ(html, report_html(r.results, true));  // same data, same bytes
}

TEST(Report, EscapesWhatComesFromOutside) {
  TestRun t;
  const std::string hostile = "<script>alert('x')</script>\"&";
  t.descriptor.name = hostile;
  t.descriptor.scenario_toml = hostile;
  t.descriptor.truth_units = {hostile, hostile};
  t.announcement.algorithm = t.announcement.tuning = t.announcement.model = hostile;
  t.announcement.state_units = {hostile, hostile};
  t.complete();
  Published p;
  p.title = hostile;
  p.notes = {hostile};
  p.rows.push_back({hostile, hostile, "speed_mps", "r2", hostile, std::nullopt, 0.5});
  const TestResults r(t.session, p);
  for (const bool figures : {false, true}) {
    const std::string html = report_html(r.results, figures);
    EXPECT_EQ(html.find("<script"), std::string::npos);
    EXPECT_NE(html.find("&lt;script&gt;alert(&#39;x&#39;)&lt;/script&gt;&quot;&amp;"), std::string::npos);
  }
}

TEST(Report, AnUnsafeNameTakesNoPart) {
  TestRun t;
  t.session.handle(t.descriptor);
  t.announcement.name = "x\" ; system \"touch /tmp/x";
  t.session.handle(t.announcement);
  Estimate m = t.estimate(0, 0.0);
  m.name = t.announcement.name;
  t.session.handle(m);
  t.session.handle(Reading{TestRun::header(0), "`id`", 1.0});
  EXPECT_TRUE(t.session.run()->estimators().empty());
  EXPECT_TRUE(t.session.run()->readings().empty());
  EXPECT_EQ(t.session.run()->rejected(), 2);
  EXPECT_EQ(t.session.run()->announcements_rejected(), 1);
}

TEST(Report, SaysThatARunIsIncomplete) {
  TestRun t;
  t.session.handle(t.descriptor);
  t.instant(0, 0.0);
  const TestResults r(t.session);
  EXPECT_NE(report_html(r.results, false).find("This run is incomplete"), std::string::npos);
  EXPECT_NE(scoreboard_text(r.results).find("INCOMPLETE"), std::string::npos);
}

TEST(Results, TwoEstimatorsOfOneNameAreWarnedOf) {
  for (const bool conflict : {false, true}) {
    TestRun t;
    t.complete();
    for (const std::int64_t instance : {1, 0}) {  // the fixture's own is 0
      t.announcement.instance = conflict ? instance : 0;
      t.session.handle(t.announcement);
    }
    const TestResults r(t.session);
    const Json e = Json::parse(scores_json(r.results))["estimators"]["ekf"];
    EXPECT_EQ(e.contains("name_conflict"), conflict);
    if (conflict) {
      EXPECT_EQ(e["name_conflict"], true);
    }
    const std::string warning = "Two estimators were named 'ekf' at the same time";
    EXPECT_EQ(report_html(r.results, false).find(warning) != std::string::npos, conflict);
  }
}

TEST(Results, AFractionalDimensionIsShownShort) {
  TestRun t;
  t.session.handle(t.descriptor);
  t.session.handle(t.announcement);
  t.instant(0, 1.0);
  Estimate both = t.estimate(1, 0.0);
  both.innovation_of = {"speed_mps", "a_x_mps2"};
  both.innovation = {1.0, 2.0};
  both.innovation_covariance = {1.0, 0.0, 0.0, 1.0};
  both.gated = {0, 0};
  t.session.handle(both);
  const TestResults r(t.session);
  const Json e = Json::parse(scores_json(r.results))["estimators"]["ekf"];
  EXPECT_EQ(e["nis"]["dimension"], 1.5);
  EXPECT_EQ(e["nis_mean"], 3.0);
  EXPECT_EQ(e["nees"]["dimension"].dump(), "2") << "a whole one has no point";
  EXPECT_EQ(consistency_table(r.results).rows[0][6], "1.5");
  EXPECT_EQ(consistency_table(r.results).rows[0][2], "2");
}

TEST(Results, EarlierRunsAreNumberedWithoutLimit) {
  const Folder folder;
  for (int i = 1; i <= 25; ++i) {
    EXPECT_EQ(earlier_directory(folder.path()), folder.path("earlier-" + std::to_string(i)));
    std::filesystem::create_directory(folder.path("earlier-" + std::to_string(i)));
  }
}

TEST(Report, WithoutGnuplotItSaysWhatToInstall) {
  TestRun t;
  t.complete();
  const TestResults r(t.session);
  const std::string path = std::getenv("PATH");
  ::setenv("PATH", "/nowhere", 1);
  const std::string html = report_html(r.results, true);
  ::setenv("PATH", path.c_str(), 1);
  EXPECT_NE(html.find("The figures are missing because gnuplot is not installed: apt-get install gnuplot-nox"),
            std::string::npos);
  EXPECT_NE(html.find("<caption>Accuracy</caption>"), std::string::npos);
}

TEST(Gnuplot, FailureAndTimeLimitAreReported) {
  if (!draw("print 1").installed) GTEST_SKIP() << "no gnuplot";
  EXPECT_NE(draw("nonsense\n").error.find("gnuplot failed"), std::string::npos);
  EXPECT_EQ(draw("pause 10\n", 0.3).error, "gnuplot did not finish within 0.3 s");
}

TEST(PlotScript, DecimationKeepsPeaks) {
  std::vector<Utime> t;
  std::vector<double> y;
  for (int i = 0; i < 100'000; ++i) {
    t.push_back(i * 1000);
    y.push_back(i == 77'777 ? 9.0 : i == 31'313 ? -9.0 : 0.0);
  }
  const Curve c = decimated(t, y);
  EXPECT_LE(c.x.size(), kMaxPlotPoints);
  EXPECT_EQ(std::count(c.y.begin(), c.y.end(), 9.0), 1);
  EXPECT_EQ(std::count(c.y.begin(), c.y.end(), -9.0), 1);
  EXPECT_TRUE(std::is_sorted(c.x.begin(), c.x.end()));
  const BandCurve b = decimated(t, y, y);
  EXPECT_LE(b.x.size(), kMaxPlotPoints);
  EXPECT_EQ(*std::max_element(b.high.begin(), b.high.end()), 9.0);
  EXPECT_EQ(*std::min_element(b.low.begin(), b.low.end()), -9.0);
}

TEST(PlotScript, TextCannotLeaveItsQuotes) {
  PlotScript script(1.0, {});
  Panel& panel = script.panel("a\"\n!touch x `id` \\ b", 100);
  script.line(panel, {{0.0, 1.0}, {0.0, 1.0}}, "with lines", "t\"; exit");
  const std::string text = script.text(1);
  EXPECT_NE(text.find("set ylabel \"a__!touch x _id_ _ b\""), std::string::npos);
  EXPECT_NE(text.find("title \"t_; exit\""), std::string::npos);
}

TEST(LiveTable, FitsItsWidthAndSaysTheScores) {
  TestRun t;
  t.complete();
  LiveTable live;
  const std::string text = live.lines(*t.session.run(), 100);
  EXPECT_NE(text.find("test-3  lockstep  1.00 of 1 s  ended"), std::string::npos);
  EXPECT_NE(text.find("ekf/matched"), std::string::npos);
  EXPECT_NE(text.find("valid"), std::string::npos);
  for (const std::size_t width : {20u, 40u, 60u, 100u}) {
    std::istringstream lines(live.lines(*t.session.run(), width));
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), width);
  }
  const std::string first = live.redraw(*t.session.run()), second = live.redraw(*t.session.run());
  EXPECT_EQ(first.find("\x1b[3A"), std::string::npos);
  EXPECT_EQ(second.find("\x1b[3A"), 0u);  // three lines up: head, titles, one estimator
}

TEST(Text, NamesAndLabels) {
  EXPECT_TRUE(is_safe_name("ekf.wheel_speed-1"));
  EXPECT_FALSE(is_safe_name(""));
  EXPECT_FALSE(is_safe_name("a b"));
  EXPECT_FALSE(is_safe_name(std::string(65, 'a')));
  EXPECT_EQ(axis_label("wheel_speed_radps", "rad/s"), "wheel speed (rad/s)");
  EXPECT_EQ(axis_label("a_x_mps2", ""), "a_x (m/s\u00b2)");
  EXPECT_EQ(axis_label("friction", "1"), "friction (-)");
  EXPECT_EQ(unit_label("\"; exit"), "?");
  EXPECT_EQ(plain_line("a\x1b[2Jb"), "a?[2Jb");
  EXPECT_EQ(wrapped("one two three four", 9, 2), "one two\n  three\n  four");
  EXPECT_EQ(wrapped("short", 9, 2), "short");
}

}  // namespace
}  // namespace slipstream
