#include "monitor/results.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "common/refusal.hpp"
#include "monitor/text.hpp"

namespace slipstream {

void write_file(const std::string& path, const std::string& text) {
  const std::string partial = path + ".partial";
  std::FILE* file = std::fopen(partial.c_str(), "w");
  bool written = file != nullptr && std::fwrite(text.data(), 1, text.size(), file) == text.size();
  int error = errno;
  if (file && std::fclose(file) != 0) {
    if (written) error = errno;
    written = false;
  }
  if (written && std::rename(partial.c_str(), path.c_str()) != 0) {
    error = errno;
    written = false;
  }
  if (written) return;
  std::remove(partial.c_str());
  throw Refusal(fmt::format("{}: cannot be written: {}", path, std::strerror(error)));
}

void write_results(const std::string& directory, const Results& results, bool with_figures) {
  write_file(directory + "/scenario.toml", results.record.info().scenario_toml);
  write_series_csv(directory + "/series.csv", results);
  write_file(directory + "/report.html", report_html(results, with_figures));
  write_file(directory + "/scores.json", scores_json(results));
}

void require_writable(const std::string& directory) {
  if (directory.empty()) throw Refusal("--out: found '', expected a folder");
  std::filesystem::path at = std::filesystem::absolute(directory);
  std::error_code error;
  while (!std::filesystem::exists(at, error) && at.has_relative_path()) at = at.parent_path();
  if (!std::filesystem::is_directory(at, error))
    throw Refusal(fmt::format("--out: '{}' is not a folder", plain_line(at.string())));
  if (::access(at.c_str(), W_OK | X_OK) != 0)
    throw Refusal(fmt::format("--out: cannot write to '{}': {}", plain_line(at.string()), std::strerror(errno)));
}

std::string earlier_directory(const std::string& directory) {
  std::string earlier;
  int number = 1;
  do {
    earlier = fmt::format("{}/earlier-{}", directory, number++);
  } while (std::filesystem::exists(earlier));
  return earlier;
}

void remove_results(const std::string& directory) {
  for (const char* name : {"scores.json", "report.html", "series.csv", "scenario.toml"})
    std::filesystem::remove(directory + "/" + name);
}

}  // namespace slipstream
