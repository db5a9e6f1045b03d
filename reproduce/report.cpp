// report.html: every item of a document under its own number, ours beside what was published. One page without external
// assets.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "monitor/gnuplot.hpp"
#include "monitor/page.hpp"
#include "monitor/results.hpp"
#include "monitor/text.hpp"
#include "reproduce/files.hpp"

namespace slipstream {
namespace {

// What the report says of a document; HTML.
struct About {
  const char* document;
  const char* lead;
  const char* caveat;   // of the verdicts
  const char* missing;  // what is not here, and why
};
constexpr std::array<About, 4> kDocuments{{
    {"000",
     "<i>Particle filter against unscented Kalman filter for a point-mass vehicle</i> (document 000): every figure and table "
     "of "
     "its results under its own number, from 100 runs each as there, in repetitions; beside them the posterior "
     "Cram&eacute;r-Rao bound, the least mean squared error that any estimator can have.",
     "The document prints neither the sampling period nor the inputs, the start, or what its filters believe: <b>better</b> "
     "says no more than that our filters do what theory says under the assumptions stated here.",
     "Figures 1 and 2 of the document are a drawing and a flow chart."},
    {"001",
     "R. G. Janke, <i>Estimativa da localiza&ccedil;&atilde;o de carros aut&ocirc;nomos baseada na fus&atilde;o de sensores "
     "IMU/GNSS utilizando o filtro de Kalman</i>, Universidade de S&atilde;o Paulo, 2024: the figures of chapter 4 under their "
     "own numbers, on a drive of ours like the document's; then what a practitioner would ask of the same filter, on a longer "
     "simulated drive and on a recorded one.",
     "The document prints two numbers, the largest height error at 25 and at 100 Hz, of one run. It prints neither its drive "
     "nor "
     "any noise, of the sensors or of the filter: ours are our own choice, and <b>better</b> says no more than that the error "
     "is "
     "smaller on a drive of the same length with the noise stated here.",
     "Figures 1 to 4 of the document are a diagram, photographs and a picture of the simulator."},
    {"002",
     "L. S. Barros, <i>Estima&ccedil;&atilde;o de estados para aplica&ccedil;&otilde;es em controle de ve&iacute;culos "
     "militares</i>, Instituto Militar de Engenharia, 2025: every figure and table of chapters 3 to 7 under its own number, "
     "computed by the plant, the estimators and the scores of this bench.",
     "The document measured a real car for Tables 6, 8, 9, 11 and 12; its data are not public. Ours there is a simulation, "
     "whose "
     "noise we chose: <b>better</b> in these tables says that our estimators follow their measurements at least as closely, no "
     "more. What they are worth stands beside it, against the truth.",
     "Figures 2 to 4, 14, 15 and 36 of the document are drawings and photographs; Table 2 is the algorithm in "
     "<code>estimators/particle_filter.hpp</code>."},
    {"past",
     "What document 002 leaves open, and what an engineer of traction or stability control needs: experiments of our own, "
     "beside "
     "the values that the document or this bench attained without.",
     "Every comparison is with a value of the same plant and the same sensors, or says what differs. Bars were set before the "
     "experiments; where one is missed, its row says so.",
     "Everything here is simulated unless its title says otherwise."},
}};

// "Fig. 16" before "Fig. 17", and a figure before a table of the same number.
std::pair<int, std::string> order_of(const std::string& item) {
  const std::size_t digit = item.find_first_of("0123456789");
  return {digit == std::string::npos ? 1000 : std::atoi(item.c_str() + digit), item};
}

std::string first_word(const std::string& verdict) { return verdict.substr(0, verdict.find_first_of(" ,")); }

std::string spread_text(const Row& r) {
  return r.spread ? fmt::format("{} to {}", number_text(r.spread->low), number_text(r.spread->high)) : "-";
}

Table rows_table(const std::vector<Row>& rows, bool with_item) {
  Table table{
      "", {{"quantity", false}, {"unit", false}, {"published"}, {"ours"}, {"spread"}, {"runs"}, {"verdict", false}}, {}};
  if (with_item) table.columns.insert(table.columns.begin(), {"item", false});
  for (const Row& r : rows) {
    std::vector<std::string> cells{r.quantity,
                                   r.unit.empty() ? "-" : r.unit,
                                   r.published ? number_text(*r.published, 6) : "-",
                                   number_text(r.ours, 5),
                                   spread_text(r),
                                   fmt::format("{}", r.runs),
                                   r.note.empty() ? r.verdict : r.verdict + ". " + r.note};
    if (with_item) cells.insert(cells.begin(), r.item);
    table.rows.push_back(std::move(cells));
  }
  return table;
}

std::string read_text(const std::string& path) {
  std::ifstream in(path);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

class Page {
 public:
  Page(const std::string& out, const std::vector<Part>& parts, const std::vector<std::string>& warnings)
      : folder_(out), parts_(parts), warnings_(warnings) {}

  std::string html() {
    html_ = page_head("Published results, reproduced: Slipstream report");
    html_ += "<h1>Published results, reproduced</h1>\n";
    html_ +=
        "<p class=\"lead\">Ours is the median over the runs (seeds 1, 2, ...), the spread their 5th to 95th percentile. "
        "<b>better</b>: the published value lies outside the spread, on the worse side. <b>equal within spread</b>: inside it, "
        "or the median agrees to the printed digit. Times are wall-clock times while other experiments run beside.</p>\n";
    for (const std::string& w : warnings_) html_ += fmt::format("<p class=\"warning\">{}</p>\n", html_escape(w));
    for (const About& about : kDocuments) document(about);
    return html_ + "</body>\n</html>\n";
  }

 private:
  void table(const Table& t) { html_ += "<div class=\"scroll\">" + to_html(t) + "</div>\n"; }

  // f(experiment, part) for those of a document that are there, in its order.
  void of_document(const std::string& document, const auto& f) const {
    for (const Experiment& e : experiments())
      for (const Part& part : parts_)
        if (e.document == document && part.experiment == e.name) f(e, part);
  }

  void document(const About& about) {
    html_ += fmt::format("<h1 id=\"document_{0}\">Document {0}, reproduced</h1>\n<p class=\"lead\">{1}</p>\n", about.document,
                         about.lead);
    bool any = false;
    of_document(about.document, [&](const Experiment&, const Part&) { any = true; });
    if (any) summary(about);
    missing(about);
    std::string chapter;
    of_document(about.document, [&](const Experiment& e, const Part& part) {
      if (e.chapter != chapter) html_ += fmt::format("<h2>{}</h2>\n", html_escape(chapter = e.chapter));
      section(e, part);
    });
  }

  void summary(const About& about) {
    std::map<std::string, int> count;
    std::vector<Row> worse;
    double elapsed_s = 0.0;
    std::string contents;
    of_document(about.document, [&](const Experiment& e, const Part& part) {
      elapsed_s += part.elapsed_s;
      contents += fmt::format("<a href=\"#{}\">{}</a> &middot; ", html_escape(e.name), html_escape(e.title));
      for (const Row& row : part.outcome.rows) {
        const std::string verdict = first_word(row.verdict);
        ++count[verdict];
        if (verdict == "worse" || verdict == "different" || verdict == "not") worse.push_back(row);
      }
    });
    html_ += "<h2>Summary</h2>\n";
    const int judged_values = count["better"] + count["equal"] + count["worse"] + count["not"];
    html_ += fmt::format(
        "<p>{} published results: {} better, {} equal within spread, {} worse, {} not computed. {} values to be met: {} met, "
        "{} "
        "different. {} further values of ours have no published counterpart. {:.0f} s of computing.</p>\n<p>{}</p>\n",
        judged_values, count["better"], count["equal"], count["worse"], count["not"], count["met"] + count["different"],
        count["met"], count["different"], count["no"] + count["inside"] + count["below"] + count["above"], elapsed_s,
        about.caveat);
    if (!worse.empty()) {
      html_ += "<p>Where ours is worse or different:</p>\n";
      table(rows_table(worse, true));
    }
    html_ += fmt::format("<p>Contents: {}<a href=\"#missing_{}\">what is not here</a></p>\n", contents, about.document);
  }

  void missing(const About& about) {
    std::string names;
    for (const Experiment& e : experiments())
      if (e.document == about.document &&
          std::none_of(parts_.begin(), parts_.end(), [&](const Part& p) { return p.experiment == e.name; }))
        names += (names.empty() ? "" : ", ") + e.name;
    html_ += fmt::format("<p id=\"missing_{}\">{}{}</p>\n", about.document,
                         names.empty() ? "" : "Not run: " + html_escape(names) + ". ", about.missing);
  }

  void section(const Experiment& e, const Part& part) {
    html_ += fmt::format("<h3 id=\"{}\">{}</h3>\n", html_escape(e.name), html_escape(e.title));
    for (const std::string& note : part.outcome.notes) html_ += fmt::format("<p>{}</p>\n", html_escape(note));
    std::map<std::pair<int, std::string>, std::string> items;  // in order
    const auto& o = part.outcome;
    for (const Picture& p : o.figures) items.emplace(order_of(p.item), p.item);
    for (const TableItem& t : o.tables) items.emplace(order_of(t.item), t.item);
    for (const Row& r : o.rows) items.emplace(order_of(r.item), r.item);
    for (const bool figures : {true, false})
      for (const auto& [order, name] : items)
        if (name.starts_with("Fig") == figures) item(o, name, item_stem(e.document, name));
  }

  void item(const Outcome& o, const std::string& name, const std::string& id) {
    for (const Picture& p : o.figures) {
      if (p.item != name) continue;
      const std::string svg = p.svg.empty() ? "" : read_text((std::filesystem::path(folder_) / "figures" / p.svg).string());
      const std::string picture =
          svg.empty() ? fmt::format("<p class=\"warning\">This figure could not be drawn: {}</p>", html_escape(p.error))
                      : inline_svg(svg, id + "-", p.title + ". " + p.caption);
      html_ += page_figure(id, picture, fmt::format("{}. {}.", name, p.title), p.caption);
    }
    bool headed = false;
    for (const TableItem& t : o.tables) {
      if (t.item != name) continue;
      Table titled = t.table;
      titled.title = fmt::format("{}. {}", name, t.table.title);
      html_ += fmt::format("<div id=\"{}\">", id);
      table(titled);
      html_ += "</div>\n";
      if (!t.caption.empty()) html_ += fmt::format("<p>{}</p>\n", html_escape(t.caption));
      headed = true;
    }
    std::vector<Row> rows;
    for (const Row& r : o.rows)
      if (r.item == name) rows.push_back(r);
    if (rows.empty()) return;
    Table t = rows_table(rows, false);
    t.title = headed || name.starts_with("Fig") ? name + ", beside the document" : name;
    table(t);
  }

  std::string folder_;
  const std::vector<Part>& parts_;
  const std::vector<std::string>& warnings_;
  std::string html_;
};

}  // namespace

void write_report(const std::string& out, const std::vector<Part>& parts, const std::vector<std::string>& warnings) {
  write_file((std::filesystem::path(out) / "report.html").string(), Page(out, parts, warnings).html());
}

}  // namespace slipstream
