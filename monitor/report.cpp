// report.html: one self-contained page, for the screen and for print. Every text from outside is escaped; a figure that cannot
// be drawn leaves a plain sentence in its place.
#include <fmt/format.h>

#include <algorithm>

#include "monitor/figures.hpp"
#include "monitor/gnuplot.hpp"
#include "monitor/results.hpp"
#include "monitor/tables.hpp"
#include "monitor/text.hpp"

namespace slipstream {
namespace {

constexpr const char* kStyle = R"(
:root { color-scheme: light; }
body { font: 16px/1.5 system-ui, -apple-system, "Segoe UI", "DejaVu Sans", sans-serif; color: #1a1a1a; background: #fff;
       max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.7rem; margin: 0 0 .2rem; } h2 { font-size: 1.25rem; margin: 2.2rem 0 .6rem; border-bottom: 1px solid #bbb; }
p.lead { margin: 0 0 1rem; color: #333; } .warning { border-left: 4px solid #D55E00; padding: .3rem .8rem; background: #fdf3ec; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: .15rem 1.2rem; margin: 0; } dt { color: #555; } dd { margin: 0; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; margin: .8rem 0 1.4rem; font-size: .94rem; font-variant-numeric: tabular-nums; }
caption { text-align: left; font-weight: 600; padding: .2rem 0; }
th, td { padding: .22rem 1.3rem .22rem 0; text-align: left; vertical-align: top; } th { border-bottom: 1.5px solid #333; }
tbody tr + tr td { border-top: 1px solid #ddd; } .number { text-align: right; white-space: nowrap; }
figure { margin: 1.4rem 0 2rem; } figure svg { width: 100%; height: auto; display: block; }
figcaption { margin-top: .5rem; font-size: .92rem; color: #333; } figcaption b { color: #1a1a1a; }
details pre { font-size: .82rem; background: #f6f6f6; padding: .8rem; overflow-x: auto; }
@media print {
  @page { margin: 15mm; }
  body { font-size: 10.5pt; max-width: none; margin: 0; padding: 0; color: #000; }
  h2 { break-after: avoid; } figure, table { break-inside: avoid; } .scroll { overflow: visible; }
  table { font-size: 9pt; } details { display: none; } figcaption { color: #000; }
}
)";

class Page {
 public:
  Page(const Results& results, bool with_figures)
      : results_(results), info_(results.record.info()), with_figures_(with_figures) {}

  std::string html() {
    const std::string title = html_escape(info_.name.empty() ? "unnamed run" : info_.name);
    out_ =
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
        "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n";
    out_ += fmt::format("<title>{}: Slipstream report</title>\n<style>{}</style>\n</head>\n<body>\n", title, kStyle);
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
        "<p>R2 = 1 - sum (estimate - truth)&#178; / sum (truth - mean of truth)&#178;: 1 is perfect. Largest error: absolute, "
        "with its time.</p>\n";
    table(consistency_table(results_));
    out_ +=
        "<p>NEES and NIS are the means of the squared error and innovation, each normalised by the covariance that the "
        "estimator claims; a consistent estimator has NEES n and NIS m, m the mean number of measurements of a "
        "step. Band: 95 % for the mean of that many independent values. Errors are correlated in time, so within one run the "
        "band of NEES is narrower than it should be.</p>\n";
    table(timing_table(results_));
    table(delivery_table(results_));
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
      out_ += fmt::format("<figure id=\"{}\">\n{}\n<figcaption><b>Figure {}. {}.</b> {}</figcaption>\n</figure>\n",
                          html_escape(figure.id), picture, number, html_escape(heading), html_escape(figure.caption));
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
