#include "io/recorded_files.hpp"

#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <set>

#include "common/geodesy.hpp"
#include "common/readings.hpp"
#include "common/refusal.hpp"
#include "common/rotation.hpp"
#include "io/csv.hpp"
#include "io/registry_names.hpp"
#include "io/toml_text.hpp"

namespace slipstream {
namespace {

constexpr double kLatest_s = 1e6;
constexpr double kFarthest_m = 100e3;  // from W's origin: beyond, its up is not the vehicle's (1 degree is 111 km)
constexpr double kUnitLength = 0.01;   // how far a recorded quaternion's length may be from 1

// Every file is read once, with all columns that are wanted of it.
class Files {
 public:
  Files(std::string folder, std::string time_column) : folder_(std::move(folder)), time_column_(std::move(time_column)) {}

  void want(const std::string& file, const std::string& column) { wanted_[file].insert(column); }

  const CsvTable& operator[](const std::string& file) {
    if (const auto found = tables_.find(file); found != tables_.end()) return found->second;
    std::set<std::string> columns = wanted_[file];
    columns.insert(time_column_);
    const CsvTable table = read_csv(path_of(file), {columns.begin(), columns.end()}, time_column_);
    const std::vector<double>& time_s = table[time_column_];
    for (std::size_t row = 0; row < time_s.size(); ++row)
      if (time_s[row] < 0.0 || time_s[row] > kLatest_s) {
        char found[40];
        std::snprintf(found, sizeof found, "%g", time_s[row]);
        throw Refusal(path_of(file) + ":" + std::to_string(table.line[row]) + ": " + time_column_ + ": found " + found +
                      ", expected a time from 0 to 1000000 s");
      }
    return tables_.emplace(file, table).first->second;
  }

  const std::vector<double>& time_s(const std::string& file) { return (*this)[file][time_column_]; }

  [[noreturn]] void refuse(const std::string& file, std::size_t row, const std::string& what) {
    throw Refusal(path_of(file) + ":" + std::to_string((*this)[file].line[row]) + ": " + what);
  }

 private:
  std::string path_of(const std::string& file) const { return (std::filesystem::path(folder_) / file).string(); }

  std::string folder_, time_column_;
  std::map<std::string, std::set<std::string>> wanted_;
  std::map<std::string, CsvTable> tables_;
};

std::vector<RecordedStream> scalar_streams(Files& files, const std::vector<RecordedColumn>& columns) {
  std::vector<RecordedStream> result;
  for (const RecordedColumn& c : columns) {
    RecordedStream stream{c.quantity, unit_of(c.quantity), files.time_s(c.file), files[c.file][c.column]};
    for (double& t_s : stream.time_s) t_s += c.lead_s;
    for (std::size_t row = 0; row < stream.value.size(); ++row) {
      for (const std::string& column : c.mean_with) stream.value[row] += files[c.file][column][row];
      stream.value[row] = c.scale * stream.value[row] / static_cast<double>(1 + c.mean_with.size()) + c.offset;
      if (!std::isfinite(stream.value[row]))
        files.refuse(c.file, row, c.column + ": not finite after scaling to " + c.quantity);
    }
    result.push_back(std::move(stream));
  }
  return result;
}

// `is_out`: of the time of measurement.
RecordedGroupStream group_stream(Files& files, const RecordedGroup& group, const LocalFrame& world,
                                 const std::function<bool(double)>& is_out) {
  RecordedGroupStream stream{group.quantity, {}, {}, group.lag_s};
  const std::vector<double>& time_s = files.time_s(group.file);
  std::vector<double> numbers(group.columns.size());
  for (std::size_t row = 0; row < time_s.size(); ++row) {
    for (std::size_t i = 0; i < numbers.size(); ++i)
      numbers[i] = files[group.file][group.columns[i]][row] * (group.scale.empty() ? 1.0 : group.scale[i]);
    if (group.frame == "enu") {
      const Geodetic at = world.to_geodetic({numbers[0], numbers[1], numbers[2]});
      numbers = {at.latitude_deg, at.longitude_deg, at.height_m};
    }
    const Values value{std::span<const double>(numbers)};
    if (const char* const problem = problem_of(group.quantity, value))
      files.refuse(group.file, row, group.quantity + ": " + problem);
    if (row == 0 && group.quantity == kGnss) {
      const double away_m = world.to_enu({value[0], value[1], value[2]}).norm();
      if (away_m > kFarthest_m)
        files.refuse(group.file, row,
                     "the first fix is " + digits(std::round(away_m / 1e3)) +
                         " km from the origin of [world]; expected at most 100 km, e.g. latitude_deg = " + digits(value[0]) +
                         ", longitude_deg = " + digits(value[1]) + ", height_m = " + digits(value[2]));
    }
    if (is_out(time_s[row] - group.lag_s)) continue;
    stream.time_s.push_back(time_s[row]);
    stream.value.push_back(value);
  }
  return stream;
}

// Roll, pitch and yaw of B: R_WB = R_WS R_BS', where S is what was recorded, as forward-left-up.
std::array<RecordedStream, 3> attitude_streams(Files& files, const RecordedAttitude& attitude) {
  std::array<RecordedStream, 3> streams{
      {{"roll_rad", "rad", {}, {}}, {"pitch_rad", "rad", {}, {}}, {"yaw_rad", "rad", {}, {}}}};
  const Rotation turned(attitude.axes == "frd" ? Rotation(0.0, 1.0, 0.0, 0.0) : Rotation::Identity());  // by pi about forward
  const Rotation q_SB = from_rpy(attitude.rpy_rad).conjugate();
  const CsvTable& table = files[attitude.file];
  for (RecordedStream& s : streams) s.time_s = files.time_s(attitude.file);
  for (std::size_t row = 0; row < table.line.size(); ++row) {
    const auto number = [&](std::size_t i) { return table[attitude.columns[i]][row]; };
    const Rotation recorded(number(0), number(1), number(2), number(3));
    if (!(std::abs(recorded.norm() - 1.0) <= kUnitLength))
      files.refuse(attitude.file, row, "found a quaternion of length " + std::to_string(recorded.norm()) + ", expected 1");
    const Vector3 rpy = to_rpy(recorded.normalized() * turned * q_SB);
    for (std::size_t i = 0; i < 3; ++i) streams[i].value.push_back(rpy[static_cast<Eigen::Index>(i)]);
  }
  return streams;
}

}  // namespace

RecordedStreams load_recorded(const Scenario& scenario, const std::string& data_dir) {
  const RecordedConfig& recorded = scenario.recorded.value();
  if (!std::filesystem::is_directory(data_dir)) throw Refusal(data_dir + ": no such data folder");
  Files files(data_dir, recorded.time_column);
  for (const auto* columns : {&recorded.sensors, &recorded.inputs, &recorded.truth})
    for (const RecordedColumn& c : *columns) {
      files.want(c.file, c.column);
      for (const std::string& column : c.mean_with) files.want(c.file, column);
    }
  for (const RecordedGroup& g : recorded.groups)
    for (const std::string& column : g.columns) files.want(g.file, column);
  if (const auto& attitude = recorded.attitude)
    for (const std::string& column : attitude->columns) files.want(attitude->file, column);
  if (const auto& path = recorded.path_speed) {
    files.want(path->file, path->x_column);
    files.want(path->file, path->y_column);
    if (!path->yaw_column.empty()) files.want(path->file, path->yaw_column);
  }

  RecordedStreams result;
  result.inputs = scalar_streams(files, recorded.inputs);
  result.sensors = scalar_streams(files, recorded.sensors);
  result.truth = scalar_streams(files, recorded.truth);
  const LocalFrame world(scenario.world.origin);
  for (const RecordedGroup& g : recorded.groups)
    result.groups.push_back(group_stream(files, g, world, [&](double t_s) {
      return (g.quantity == kGnss && scenario.gnss->is_out(t_s)) || (g.quantity == kLidar && scenario.lidar->is_out(t_s));
    }));
  if (recorded.attitude)
    for (RecordedStream& stream : attitude_streams(files, *recorded.attitude)) result.truth.push_back(std::move(stream));
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
