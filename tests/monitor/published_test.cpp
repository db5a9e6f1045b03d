#include "monitor/published.hpp"

#include <gtest/gtest.h>

#include "common/refusal.hpp"

namespace slipstream {
namespace {

std::string refusal_of(const std::string& text) {
  try {
    parse_published(text, "p.json");
  } catch (const Refusal& refusal) {
    return refusal.what();
  }
  return "accepted";
}

std::string with_row(const std::string& row) { return R"({"title": "t", "rows": [)" + row + "]}"; }

TEST(Published, RefusalsReadWell) {
  EXPECT_EQ(refusal_of("{\n\"title\": \"t\",\n\"rows\" [\n"), "p.json:3: this is not JSON");
  EXPECT_EQ(refusal_of("[]"), "p.json: found [], expected an object");
  EXPECT_EQ(refusal_of(R"({"rows": []})"), "p.json: the key \"title\" is missing");
  EXPECT_EQ(refusal_of(R"({"title": "t", "rows": [], "note": []})"),
            "p.json: unknown key \"note\", expected one of: title, rows, notes");
  EXPECT_EQ(refusal_of(R"({"title": "t", "rows": 3})"), "p.json: rows: found 3, expected a list");
  EXPECT_EQ(refusal_of(R"({"title": "t", "rows": [], "notes": ["a", 2]})"), "p.json: notes[1]: found 2, expected a text");
  EXPECT_EQ(refusal_of(with_row(R"({"algorithm": "ekf"})")), "p.json: rows[0]: the key \"tuning\" is missing");
  EXPECT_EQ(refusal_of(with_row(R"({"algorithm": "ekf", "tuning": "d", "metric": "r3"})")),
            "p.json: rows[0].metric: found \"r3\", expected one of: r2, rmse, max_abs_error, step_time_us");
  EXPECT_EQ(refusal_of(with_row(R"({"algorithm": "ekf", "tuning": "d", "metric": "r2", "value": 1, "source": "s"})")),
            "p.json: rows[0]: metric \"r2\" needs the key \"state\"");
  EXPECT_EQ(
      refusal_of(with_row(R"({"algorithm": "e", "tuning": "d", "metric": "r2", "state": "x", "value": "1", "source": "s"})")),
      "p.json: rows[0].value: found \"1\", expected a number");
}

TEST(Published, AMissingFileIsRefused) {
  try {
    load_published("/nowhere/p.json");
    FAIL();
  } catch (const Refusal& refusal) {
    EXPECT_STREQ(refusal.what(), "/nowhere/p.json: cannot be read, expected a JSON file of published values");
  }
}

TEST(Published, RowsAreFoundByAlgorithmStateMetricAndNoise) {
  const Published p = parse_published(
      with_row(
          R"({"algorithm": "ekf", "tuning": "d", "metric": "r2", "state": "x", "noise_percent": 5, "value": 0.5, "source": "s"},
                  {"algorithm": "ekf", "tuning": "d", "metric": "step_time_us", "value": 7, "source": "s"})"),
      "p.json");
  ASSERT_NE(p.find("ekf", "x", "r2", 5.0), nullptr);
  EXPECT_EQ(p.find("ekf", "x", "r2", 5.0)->value, 0.5);
  EXPECT_EQ(p.find("ekf", "x", "r2", 10.0), nullptr);
  EXPECT_EQ(p.find("ekf", "x", "r2", std::nullopt), nullptr);  // the run's noise is not known to agree
  EXPECT_EQ(p.find("mhe", "x", "r2", 5.0), nullptr);
  EXPECT_EQ(p.find("ekf", "", "step_time_us", 10.0)->value, 7.0);  // holds for any noise
}

// Document 002, Table 16, and the times below it.
TEST(Published, TheUnimogFileHoldsTheTable) {
  const Published p = load_published(SLIPSTREAM_SOURCE_DIR "/scenarios/published_unimog.json");
  const auto value = [&](const char* algorithm, const char* state, double noise) {
    return p.find(algorithm, state, *state ? "r2" : "step_time_us", noise)->value;
  };
  EXPECT_EQ(value("ekf", "friction", 5), 0.9639);
  EXPECT_EQ(value("ekf", "friction", 10), 0.8590);
  EXPECT_EQ(value("mhe", "friction", 5), 0.9712);
  EXPECT_EQ(value("mhe", "friction", 10), 0.9452);
  EXPECT_EQ(value("ekf", "wheel_speed_radps", 5), 0.9960);
  EXPECT_EQ(value("ekf", "wheel_speed_radps", 10), 0.9868);
  EXPECT_EQ(value("mhe", "wheel_speed_radps", 5), 0.9979);
  EXPECT_EQ(value("mhe", "wheel_speed_radps", 10), 0.9927);
  for (const char* algorithm : {"ekf", "mhe"})
    for (const double noise : {5.0, 10.0}) EXPECT_EQ(value(algorithm, "speed_mps", noise), 1.0);
  EXPECT_EQ(value("ekf", "", 5), 1200.0);
  EXPECT_EQ(value("ekf", "", 10), 1200.0);
  EXPECT_EQ(value("mhe", "", 5), 7700.0);
  EXPECT_EQ(value("mhe", "", 10), 8300.0);
}

}  // namespace
}  // namespace slipstream
