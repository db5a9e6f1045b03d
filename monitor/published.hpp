// Numbers that a document prints for an experiment, shown beside ours. A JSON file:
//
//   {"title": "...",
//    "rows": [{"algorithm": "ekf", "tuning": "document", "state": "friction", "metric": "r2", "noise_percent": 5,
//              "value": 0.9639, "source": "document 002, Table 16"}],
//    "notes": ["What differs, and why."]}
//
// metric: r2, rmse, max_abs_error (with a state) or step_time_us (without). noise_percent may be absent: then the row holds for
// any noise.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace slipstream {

struct PublishedRow {
  std::string algorithm, tuning, state, metric, source;
  std::optional<double> noise_percent;
  double value = 0.0;
};

struct Published {
  std::string title;
  std::vector<PublishedRow> rows;
  std::vector<std::string> notes;

  // The first row for this algorithm, state ("" for step_time_us) and metric whose noise agrees with the run's; null if none.
  const PublishedRow* find(const std::string& algorithm, const std::string& state, const std::string& metric,
                           std::optional<double> noise_percent) const;
};

// Refuses a file that is not of this form, in one line.
Published load_published(const std::string& path);
Published parse_published(const std::string& text, const std::string& source_name);

}  // namespace slipstream
