// series.csv: a merge of all series over utime, one row an instant. Angles in rad: the truth unwrapped, estimates on its turn,
// so that their difference is the error.
#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <functional>
#include <memory>

#include "common/refusal.hpp"
#include "monitor/results.hpp"

namespace slipstream {
namespace {

// 17 significant digits: every double reads back as the same double.
void append(std::string& line, double value) {
  line += ',';
  if (std::isfinite(value)) line += fmt::format("{:.17g}", value);
}

// One series among those that are merged: its instants, its header cells, and how it prints a row.
struct Block {
  const std::vector<Utime>* utime;
  std::string header;
  std::size_t columns;
  std::function<void(std::string& line, std::size_t row)> print;
  std::size_t next = 0;
};

std::vector<Block> blocks_of(const Results& results) {
  std::vector<Block> blocks;
  const RunRecord& run = results.record;
  std::string header;
  for (const std::string& name : run.info().truth_names) header += ",truth_" + name;
  blocks.push_back({&run.truth().utime, header, run.truth().column.size(), [&run](std::string& line, std::size_t row) {
                      for (const auto& column : run.truth().column) append(line, column[row]);
                    }});
  for (const auto& [quantity, reading] : run.readings())
    blocks.push_back({&reading.utime, ",measured_" + quantity, 1,
                      [&r = reading](std::string& line, std::size_t row) { append(line, r.value[row]); }});
  for (const EstimatorScore& s : results.board.estimators) {
    const EstimatorRecord& r = *s.record;
    if (r.utime.empty()) continue;
    header.clear();
    for (std::size_t i = 0; i < r.states; ++i) {
      const std::string state = i < r.state_names.size() ? r.state_names[i] : fmt::format("state{}", i);
      header += fmt::format(",{0}.{1},{0}.{1}.sigma", s.name, state);
    }
    header += fmt::format(",{0}.status,{0}.nees,{0}.nis,{0}.step_time_us", s.name);
    blocks.push_back({&r.utime, header, 2 * r.states + 4, [&s, &r](std::string& line, std::size_t row) {
                        for (std::size_t i = 0; i < r.states; ++i) {
                          append(line, i < s.states.size() ? s.states[i].estimate[row] : r.mean[i][row]);
                          append(line, r.sigma(row, i));
                        }
                        line += fmt::format(",{}", static_cast<int>(r.row_status[row]));
                        append(line, s.nees[row]);
                        append(line, r.nis[row]);
                        append(line, r.step_time_us[row]);
                      }});
  }
  return blocks;
}

}  // namespace

void write_series_csv(const std::string& path, const Results& results) {
  const std::string partial = path + ".partial";
  const auto refuse = [&](int error) {
    std::remove(partial.c_str());
    throw Refusal(fmt::format("{}: cannot be written: {}", path, std::strerror(error)));
  };
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(partial.c_str(), "w"), &std::fclose);
  if (!file) refuse(errno);
  std::vector<Block> blocks = blocks_of(results);
  std::string line = "t_s";
  for (const Block& block : blocks) line += block.header;
  line += '\n';
  bool written = std::fwrite(line.data(), 1, line.size(), file.get()) == line.size();
  while (written) {
    bool any = false;
    Utime now = 0;
    for (const Block& block : blocks) {
      if (block.next == block.utime->size()) continue;
      const Utime t = (*block.utime)[block.next];
      now = any ? std::min(now, t) : t;
      any = true;
    }
    if (!any) break;
    line = fmt::format("{}.{:06}", now / 1'000'000, now % 1'000'000);
    for (Block& block : blocks) {
      if (block.next < block.utime->size() && (*block.utime)[block.next] == now) {
        block.print(line, block.next++);
      } else {
        line.append(block.columns, ',');
      }
    }
    line += '\n';
    written = std::fwrite(line.data(), 1, line.size(), file.get()) == line.size();
  }
  const int error = errno;
  if (std::fclose(file.release()) != 0 || !written) refuse(written ? errno : error);
  std::filesystem::rename(partial, path);
}

}  // namespace slipstream
