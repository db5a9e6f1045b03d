#include "io/recorded_files.hpp"

#include <cmath>
#include <filesystem>
#include <map>
#include <set>

#include "common/refusal.hpp"
#include "io/csv.hpp"
#include "io/registry_names.hpp"

namespace slipstream {
namespace {

constexpr double kLatest_s = 1e6;

// Every file is read once, with all columns that are wanted of it.
class Files {
 public:
  Files(std::string folder, std::string time_column) : folder_(std::move(folder)), time_column_(std::move(time_column)) {}

  void want(const std::string& file, const std::string& column) { wanted_[file].insert(column); }

  const CsvTable& operator[](const std::string& file) {
    if (const auto found = tables_.find(file); found != tables_.end()) return found->second;
    std::set<std::string> columns = wanted_[file];
    columns.insert(time_column_);
    const std::string path = (std::filesystem::path(folder_) / file).string();
    const CsvTable table = read_csv(path, {columns.begin(), columns.end()}, time_column_);
    const std::vector<double>& time_s = table[time_column_];
    for (std::size_t row = 0; row < time_s.size(); ++row)
      if (time_s[row] < 0.0 || time_s[row] > kLatest_s) {
        char found[40];
        std::snprintf(found, sizeof found, "%g", time_s[row]);
        throw Refusal(path + ":" + std::to_string(table.line[row]) + ": " + time_column_ + ": found " + found +
                      ", expected a time from 0 to 1000000 s");
      }
    return tables_.emplace(file, table).first->second;
  }

 private:
  std::string folder_, time_column_;
  std::map<std::string, std::set<std::string>> wanted_;
  std::map<std::string, CsvTable> tables_;
};

}  // namespace

RecordedStreams load_recorded(const RecordedConfig& recorded, const std::string& data_dir) {
  if (!std::filesystem::is_directory(data_dir)) throw Refusal(data_dir + ": no such data folder");
  Files files(data_dir, recorded.time_column);
  for (const auto* columns : {&recorded.sensors, &recorded.inputs, &recorded.truth})
    for (const RecordedColumn& c : *columns) files.want(c.file, c.column);
  if (const auto& path = recorded.path_speed) {
    files.want(path->file, path->x_column);
    files.want(path->file, path->y_column);
    if (!path->yaw_column.empty()) files.want(path->file, path->yaw_column);
  }

  const auto streams = [&](const std::vector<RecordedColumn>& columns) {
    std::vector<RecordedStream> result;
    for (const RecordedColumn& c : columns) {
      const CsvTable& table = files[c.file];
      RecordedStream stream{c.quantity, unit_of(c.quantity), table[recorded.time_column], table[c.column]};
      for (std::size_t row = 0; row < stream.value.size(); ++row) {
        stream.value[row] = c.scale * stream.value[row] + c.offset;
        if (!std::isfinite(stream.value[row]))
          throw Refusal((std::filesystem::path(data_dir) / c.file).string() + ":" + std::to_string(table.line[row]) + ": " +
                        c.column + ": not finite after scaling to " + c.quantity);
      }
      result.push_back(std::move(stream));
    }
    return result;
  };
  RecordedStreams result{streams(recorded.inputs), streams(recorded.sensors), {}, streams(recorded.truth), std::nullopt};
  if (const auto& path = recorded.path_speed) {
    const CsvTable& table = files[path->file];
    result.path = RecordedPath{table[recorded.time_column],
                               table[path->x_column],
                               table[path->y_column],
                               path->yaw_column.empty() ? std::vector<double>{} : table[path->yaw_column],
                               path->window_s,
                               path->max_residual_m};
  }
  return result;
}

}  // namespace slipstream
