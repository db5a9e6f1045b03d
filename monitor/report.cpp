// report.html: one self-contained page, for the screen and for print. Every text from outside is escaped; a figure that cannot
// be drawn leaves a plain sentence in its place.
#include <fmt/format.h>

#include <algorithm>

#include "monitor/figures.hpp"
#include "monitor/gnuplot.hpp"
#include "monitor/page.hpp"
#include "monitor/results.hpp"
#include "monitor/tables.hpp"
#include "monitor/text.hpp"

namespace slipstream {
namespace {

class Page {
 public:
  Page(const Results& results, bool with_figures)
      : results_(results), info_(results.record.info()), with_figures_(with_figures) {}

  std::string html() {
    const std::string title = html_escape(info_.name.empty() ? "unnamed run" : info_.name);
    out_ = page_head(title + ": Slipstream report");
    out_ += fmt::format("<h1>{}</h1>\n<p class=\"lead\">{}</p>\n", title, html_escape(info_.description));
    warnings();
    facts();
    scores();
    notes();
    figures();
    out_ += fmt::format(
        "<h2>Scenario</h2>\n<details><summary>The scenario with every default filled in</summary>\n<pre>{}</pre></details>\n",
        html_escape(info_.scenario_toml));
    return out_ + "</body>\n</html>\n";
  }

 private:
  void warning(const std::string& text) { out_ += fmt::format("<p class=\"warning\">{}</p>\n", text); }

  void warnings() {
    if (!results_.board.complete)
      warning("This run is incomplete: it was stopped, or its end was not seen. The scores cover what was.");
    if (!results_.record.seen_from_start()) warning("The beginning of this run was not seen.");
    if (results_.record.truth().utime.empty()) warning("No truth was published in this run: nothing is scored against it.");
    for (const EstimatorScore& s : results_.board.estimators)
      if (s.record->name_conflict)
        warning(fmt::format("Two estimators were named '{}' at the same time: its rows mix the estimates of both.",
                            html_escape(s.name)));
    for (const std::string& line : warning_lines(results_.board)) warning(html_escape(line));
    if (info_.scenario.empty()) warning("The scenario of this run could not be read: its facts are missing here.");
  }

  void fact(const std::string& key, const std::string& value) {
    out_ += fmt::format("<dt>{}</dt><dd>{}</dd>\n", html_escape(key), html_escape(value));
  }

  void facts() {
    out_ += "<h2>Run</h2>\n<dl>\n";
    fact("Scenario", info_.scenario.empty() ? "-" : info_.scenario);
    fact("Seed", info_.seed ? fmt::format("{}", *info_.seed) : "-");
    const double simulated_s = seconds(results_.record.simulated());
    fact("Simulated", info_.duration_s ? fmt::format("{:g} s of {:g} s", simulated_s, *info_.duration_s)
                                       : fmt::format("{:g} s", simulated_s));
    fact("Clock", info_.clock);
    if (info_.noise_percent) fact("Measurement noise", fmt::format("{:g} % of the value, each sensor", *info_.noise_percent));
    if (info_.deadline_s > 0.0) fact("Deadline of a step", fmt::format("{:g} ms", info_.deadline_s * 1e3));
    for (const auto& [key, value] : info_.facts) fact(key, value);
    for (const EstimatorScore& s : results_.board.estimators)
      fact("Estimator " + s.name,
           fmt::format("{}, tuning {}, model {}", s.record->algorithm, s.record->tuning, s.record->model));
    fact("Started", results_.times.started_utc);
    fact("Wall clock", fmt::format("{:.1f} s", results_.times.wall_s));
    out_ += "</dl>\n";
  }

  void table(const Table& table) { out_ += "<div class=\"scroll\">" + to_html(table) + "</div>\n"; }

  void scores() {
    out_ += "<h2>Scores</h2>\n";
    if (results_.board.estimators.empty()) out_ += "<p>No estimator took part.</p>\n";
    if (results_.board.estimators.empty()) return;
    table(accuracy_table(results_));
    out_ +=
        "<p>Angles are in degrees here, in rad in the files. R2 = 1 - sum (estimate - truth)&#178; / sum (truth - mean of "
        "truth)&#178;: 1 is perfect. Largest error: absolute, "
        "with its time.</p>\n";
    if (const std::string none = no_bound_text(results_.board); !none.empty())
      out_ += fmt::format("<p>{}</p>\n", html_escape(none));
    else
      out_ +=
          "<p>Efficiency: the posterior Cramer-Rao bound over the mean squared error, both summed over the scored instants. 1 "
          "is the "
          "best that an estimator can do on the average of many runs; on a single run, as here, it scatters and may exceed "
          "1.</p>\n";
    table(consistency_table(results_));
    out_ +=
        "<p>NEES and NIS are the means of the squared error and innovation, each normalised by the covariance that the "
        "estimator claims; a consistent estimator has NEES n and NIS m, m the mean number of measurements of a "
        "step. Band: 95 % for the mean of that many independent values. Errors are correlated in time, so within one run the "
        "band of NEES is narrower than it should be.</p>\n";
    table(sensor_table(results_));
    out_ +=
        "<p>NIS of each sensor's own measurements, over those that were not gated, that is, left out of the estimate as too "
        "unlikely; gating cuts the largest values off. A mean below its band: the estimator is more cautious than it need be; "
        "above: it is too sure.</p>\n";
    table(timing_table(results_));
    table(delivery_table(results_));
    if (info_.clock == "realtime")
      out_ +=
          "<p>Missed: steps that took longer than the deadline. Late: estimates that arrived when the plant was already "
          "further on than the "
          "deadline, because of this step, an earlier one, or the way; they are scored like the others.</p>\n";
  }

  void notes() {
    if (!results_.published) return;
    const Published& p = *results_.published;
    out_ += "<h2>Beside the published values</h2>\n";
    out_ += fmt::format(
        "<p>{}. Shown are the rows for the algorithms and the noise of this run; the tuning they were published "
        "with stands in brackets.</p>\n",
        html_escape(p.title));
    std::vector<std::string> sources;
    for (const PublishedRow& row : p.rows)
      if (std::find(sources.begin(), sources.end(), row.source) == sources.end()) sources.push_back(row.source);
    if (!sources.empty())
      out_ += fmt::format("<p>Sources: {}.</p>\n", html_escape(fmt::format("{}", fmt::join(sources, "; "))));
    if (p.notes.empty()) return;
    out_ += "<p>What differs, and why:</p>\n<ul>\n";
    for (const std::string& note : p.notes) out_ += fmt::format("<li>{}</li>\n", html_escape(note));
    out_ += "</ul>\n";
  }

  void figures() {
    out_ += "<h2>Figures</h2>\n";
    if (!with_figures_) {
      out_ += "<p>The figures were left out because another run began while this one was on.</p>\n";
      return;
    }
    int number = 0;
    for (const Figure& figure : make_figures(results_)) {
      const Drawing drawing = draw(figure.script);
      if (!drawing.installed) {
        out_ +=
            "<p class=\"warning\">The figures are missing because gnuplot is not installed: apt-get install gnuplot-nox</p>\n";
        return;
      }
      ++number;
      std::string heading = figure.title;  // "a_x" stays as it is
      if (heading.size() > 1 && heading[1] != '_' && heading[0] >= 'a' && heading[0] <= 'z')
        heading[0] = static_cast<char>(heading[0] - 'a' + 'A');
      const std::string picture =
          drawing.svg.empty()
              ? fmt::format("<p class=\"warning\">This figure could not be drawn: {}</p>", html_escape(drawing.error))
              : inline_svg(drawing.svg, fmt::format("f{}-", number), figure.title + ". " + figure.caption);
      out_ += page_figure(figure.id, picture, fmt::format("Figure {}. {}.", number, heading), figure.caption);
    }
  }

  const Results& results_;
  const RunInfo& info_;
  bool with_figures_;
  std::string out_;
};

}  // namespace

std::string report_html(const Results& results, bool with_figures) { return Page(results, with_figures).html(); }

}  // namespace slipstream
