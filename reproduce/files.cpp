#include "reproduce/files.hpp"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/refusal.hpp"
#include "monitor/gnuplot.hpp"
#include "monitor/results.hpp"

namespace slipstream {
namespace {

using Json = nlohmann::ordered_json;

// JSON has no NaN: what is not known is null.
Json number(double v) { return std::isfinite(v) ? Json(v) : Json(nullptr); }
double number_of(const Json& j) { return j.is_number() ? j.get<double>() : std::nan(""); }

Json to_json(const Row& r, const std::string& document) {
  return {{"document", document},
          {"item", r.item},
          {"quantity", r.quantity},
          {"unit", r.unit},
          {"published", r.published ? number(*r.published) : Json(nullptr)},
          {"ours", number(r.ours)},
          {"spread", r.spread ? Json::array({number(r.spread->low), number(r.spread->high)}) : Json(nullptr)},
          {"runs", r.runs},
          {"verdict", r.verdict},
          {"note", r.note}};
}
Row row_of(const Json& j) {
  Row r;
  r.item = j.at("item");
  r.quantity = j.at("quantity");
  r.unit = j.at("unit");
  if (j.at("published").is_number()) r.published = j.at("published").get<double>();
  r.ours = number_of(j.at("ours"));
  if (j.at("spread").is_array()) r.spread = Band{number_of(j.at("spread").at(0)), number_of(j.at("spread").at(1))};
  r.runs = j.at("runs");
  r.verdict = j.at("verdict");
  r.note = j.at("note");
  return r;
}

Json to_json(const TableItem& t) {
  Json columns = Json::array();
  for (const Table::Column& c : t.table.columns) columns.push_back({{"title", c.title}, {"number", c.is_number}});
  return {{"item", t.item}, {"caption", t.caption}, {"title", t.table.title}, {"columns", columns}, {"rows", t.table.rows}};
}
TableItem table_of(const Json& j) {
  TableItem t{j.at("item"), j.at("caption"), {j.at("title"), {}, j.at("rows")}};
  for (const Json& c : j.at("columns")) t.table.columns.push_back({c.at("title"), c.at("number")});
  return t;
}

std::string csv_cell(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}
std::string csv_of(const Table& table) {
  std::string csv;
  const auto add = [&csv](const auto& cells, const auto& text) {
    for (std::size_t i = 0; i < cells.size(); ++i) csv += (i > 0 ? "," : "") + csv_cell(text(cells[i]));
    csv += '\n';
  };
  add(table.columns, [](const Table::Column& c) { return c.title; });
  for (const auto& row : table.rows) add(row, [](const std::string& cell) { return cell; });
  return csv;
}

std::string path(const std::string& out, const std::string& file) { return (std::filesystem::path(out) / file).string(); }

}  // namespace

std::string file_stem(const std::string& item) {
  std::string stem;
  for (const char c : item) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0)
      stem += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    else if (!stem.empty() && stem.back() != '_')
      stem += '_';
  }
  return stem;
}

std::string item_stem(const std::string& document, const std::string& item) {
  return (document == "002" ? "" : document + "_") + file_stem(item);
}

void prepare_output(const std::string& out) {
  for (const char* folder : {"", "figures", "tables", "parts"}) {
    const std::filesystem::path wanted = std::filesystem::path(out) / folder;
    std::error_code error;
    std::filesystem::create_directories(wanted, error);
    if (std::filesystem::exists(out) && !std::filesystem::is_directory(out))
      throw Refusal(fmt::format("--out: {} is not a folder", out));
    if (error || !std::filesystem::is_directory(wanted))
      throw Refusal(fmt::format("--out: cannot make the folder {}{}", wanted.string(), error ? ": " + error.message() : ""));
    require_writable(wanted.string());
  }
}

void write_part(const std::string& out, Part part) {
  Json figures = Json::array(), tables = Json::array(), rows = Json::array();
  for (Picture& p : part.outcome.figures) {
    const std::string stem = item_stem(part.document, p.item);
    const Drawing drawing = draw(p.script, 60.0);
    if (drawing.svg.empty()) {
      p.error = drawing.installed ? drawing.error : "gnuplot is not installed: apt-get install gnuplot-nox";
    } else {
      p.svg = stem + ".svg";
      write_file(path(out, "figures/" + p.svg), drawing.svg);
    }
    write_file(path(out, "figures/" + stem + ".csv"), p.csv);
    figures.push_back({{"item", p.item}, {"title", p.title}, {"caption", p.caption}, {"svg", p.svg}, {"error", p.error}});
  }
  for (const TableItem& t : part.outcome.tables) {
    write_file(path(out, "tables/" + item_stem(part.document, t.item) + ".csv"), csv_of(t.table));
    tables.push_back(to_json(t));
  }
  for (const Row& r : part.outcome.rows) rows.push_back(to_json(r, part.document));
  const Json file = {{"document", part.document},
                     {"experiment", part.experiment},
                     {"key", part.key},
                     {"elapsed_s", part.elapsed_s},
                     {"rows", rows},
                     {"tables", tables},
                     {"figures", figures},
                     {"notes", part.outcome.notes}};
  write_file(path(out, "parts/" + part.experiment + ".json"), file.dump(1) + "\n");
}

std::optional<Part> read_part(const std::string& out, const std::string& experiment, const std::string& key) {
  std::ifstream in(path(out, "parts/" + experiment + ".json"));
  const Json j = Json::parse(in, nullptr, false);
  if (j.is_discarded()) return std::nullopt;
  try {
    if (j.at("key") != key || j.at("experiment") != experiment) return std::nullopt;
    Part part{j.at("document"), experiment, key, number_of(j.at("elapsed_s")), {}};
    for (const Json& r : j.at("rows")) part.outcome.rows.push_back(row_of(r));
    for (const Json& t : j.at("tables")) part.outcome.tables.push_back(table_of(t));
    for (const Json& f : j.at("figures")) {
      part.outcome.figures.push_back({f.at("item"), f.at("title"), f.at("caption"), "", f.at("svg"), f.at("error"), ""});
      const std::string& svg = part.outcome.figures.back().svg;
      if (!svg.empty() && !std::filesystem::exists(path(out, "figures/" + svg))) return std::nullopt;
    }
    for (const Json& n : j.at("notes")) part.outcome.notes.push_back(n);
    return part;
  } catch (const nlohmann::json::exception&) {
    return std::nullopt;  // not a part of this form: computed again
  }
}

void write_results(const std::string& out, const std::vector<Part>& parts) {
  Json list = Json::array();
  for (const Part& part : parts)
    for (const Row& row : part.outcome.rows) list.push_back(to_json(row, part.document));
  write_file(path(out, "results.json"), list.dump(1) + "\n");
}

}  // namespace slipstream
