#include "io/csv.hpp"

#include <csv.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <memory>

#include "common/check.hpp"
#include "common/refusal.hpp"
#include "io/suggest.hpp"
#include "io/text_file.hpp"

namespace slipstream {
namespace {

// Collects rows. libcsv calls it through C, where nothing may be thrown: the first problem is kept for later.
struct Collector {
  explicit Collector(const std::vector<std::string>& wanted) { table.columns = wanted; }

  CsvTable table;
  std::string increasing;
  std::vector<std::string> header;
  std::vector<std::size_t> position;  // of each wanted column in the header
  std::vector<std::string> row;
  long line = 0;  // being fed; 0: past the end
  std::string problem;
  long problem_line = 0;

  void report(const std::string& what) {
    if (!problem.empty()) return;
    problem = what;
    problem_line = line;
  }

  void take_cell(const void* text, std::size_t size) { row.emplace_back(static_cast<const char*>(text), size); }

  void take_row() {
    if (problem.empty()) header.empty() ? take_header() : take_numbers();
    row.clear();
  }

  void take_header() {
    header = row;
    for (const std::string& column : table.columns) {
      const auto found = std::find(header.begin(), header.end(), column);
      if (found == header.end()) return report("missing column '" + column + "'" + suggestion(column, header));
      if (std::find(found + 1, header.end(), column) != header.end()) return report("column '" + column + "' appears twice");
      position.push_back(static_cast<std::size_t>(found - header.begin()));
    }
    table.values.resize(table.columns.size());
  }

  void take_numbers() {
    if (row.size() != header.size())
      return report("found " + std::to_string(row.size()) + (row.size() == 1 ? " cell" : " cells") + ", expected " +
                    std::to_string(header.size()) + " as in the header");
    for (std::size_t i = 0; i < position.size(); ++i) {
      const std::string& cell = row[position[i]];
      const std::string digits = cell.starts_with('+') ? cell.substr(1) : cell;
      double number = 0.0;
      const char* const end = digits.data() + digits.size();
      const auto [rest, error] = std::from_chars(digits.data(), end, number);
      if (error != std::errc() || rest != end || !std::isfinite(number) || digits.starts_with("-") != cell.starts_with("-"))
        return report(table.columns[i] + ": found '" + printable(cell) + "', expected a finite number");
      if (table.columns[i] == increasing && !table.values[i].empty() && !(number > table.values[i].back()))
        return report(increasing + ": found " + cell + ", expected more than the row before it");
      table.values[i].push_back(number);
    }
    table.line.push_back(line);
  }
};

void on_cell(void* text, std::size_t size, void* collector) { static_cast<Collector*>(collector)->take_cell(text, size); }
void on_row(int, void* collector) { static_cast<Collector*>(collector)->take_row(); }

}  // namespace

const std::vector<double>& CsvTable::operator[](const std::string& column) const {
  const auto found = std::find(columns.begin(), columns.end(), column);
  SLIPSTREAM_CHECK(found != columns.end());
  return values[static_cast<std::size_t>(found - columns.begin())];
}

CsvTable read_csv(const std::string& path, const std::vector<std::string>& columns, const std::string& increasing) {
  std::string text = read_text_file(path);
  if (text.starts_with("\xEF\xBB\xBF")) text.erase(0, 3);  // byte order mark

  Collector collector(columns);
  collector.increasing = increasing;
  csv_parser state;
  csv_init(&state, CSV_STRICT | CSV_STRICT_FINI);
  const std::unique_ptr<csv_parser, decltype(&csv_free)> parser(&state, &csv_free);

  const auto refuse = [&](long line, const std::string& what) {
    throw Refusal(path + (line > 0 ? ":" + std::to_string(line) : std::string()) + ": " + what);
  };
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size() - 1) + 1;
    ++collector.line;
    if (csv_parse(&state, text.data() + begin, end - begin, on_cell, on_row, &collector) != end - begin)
      refuse(collector.line, std::string("malformed: ") + csv_strerror(csv_error(&state)));
    if (!collector.problem.empty()) refuse(collector.problem_line, collector.problem);
    begin = end;
  }
  if (csv_fini(&state, on_cell, on_row, &collector) != 0) refuse(collector.line, "malformed: a quoted cell does not end");
  if (!collector.problem.empty()) refuse(collector.problem_line, collector.problem);
  if (collector.header.empty()) refuse(0, "empty, expected a header line");
  if (collector.table.line.empty()) refuse(0, "no rows after the header");
  return collector.table;
}

}  // namespace slipstream
