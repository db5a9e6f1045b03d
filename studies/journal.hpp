// The durable lines of a study's runs in its folder, and the folder itself:
//
//   study.toml, scenarios/NAME.toml   the study, resolved; the first line of study.toml has its key
//   runs.jsonl                        one line a run, in the order in which they were finished
//   runs-K-of-N.jsonl                 the same of shard K of N; several may be written at a time
//   results.json, timings.json        of a finished study (studies/summary.hpp)
//
// Lines are appended whole and are on the disk a second later. What a sudden end tears off is recognised and cut off. One
// process writes a file at a time: .runs.lock says which. Locks are fcntl's: they work across the hosts of a shared disk.
#pragma once

#include <chrono>
#include <cstdint>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "models/study.hpp"
#include "studies/run_line.hpp"

namespace slipstream {

struct Shard {
  std::size_t index = 1, of = 1;  // item i belongs to shard i % of + 1
  bool has(std::size_t item) const { return item % of == index - 1; }
  std::string file() const;  // "runs.jsonl" or "runs-2-of-3.jsonl"
};

// A lock of this process (not of its children), which ends with it, however that ends. The file has its holder's name.
class FileLock {
 public:
  enum class When { kNow, kWait };
  // Refuses, at once or never, what another process holds: "... is being written by process 7 on host".
  FileLock(const std::string& path, const std::string& guarded, When when);
  ~FileLock();
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;

 private:
  int file_ = -1;
};

// Held while files of the whole folder are written.
FileLock lock_folder(const std::string& folder);

// Makes the folder this study's. Refuses one that cannot be made or written, and one that holds another study.
void claim_folder(const std::string& folder, const Study& study);

// The first line of a folder's study.toml: "# study KEY".
std::string study_head(const Study& study);

// Every runs*.jsonl of a folder, sorted by name.
std::vector<std::string> runs_files(const std::string& folder);

// Where the lines of a study's items are.
class KnownRuns {
 public:
  explicit KnownRuns(const Study& study) : study_(study), places_(study.items()) {}

  // Adds a file's lines. Refuses one of another study, one that cannot be read, and a second result of an item that differs
  // from the first. Returns the bytes of a torn last line, which are left out.
  std::size_t read(const std::string& path);

  bool has(std::size_t item) const { return places_[item].has_value(); }
  std::size_t count() const { return count_; }
  std::size_t repeated() const { return repeated_; }  // lines of items that were there already, with the same result
  std::string text(std::size_t item) const;           // its line
  RunLine run(std::size_t item) const;                // refuses a line that is damaged inside
  std::string place(std::size_t item) const;          // "FILE:LINE"

 private:
  struct Place {
    std::size_t file, line;
    std::int64_t begin;
    std::size_t size;
  };
  std::optional<std::pair<std::size_t, std::uint64_t>> glance(const std::string& line) const;

  const Study& study_;
  std::vector<std::string> files_;
  std::vector<std::optional<Place>> places_;
  std::size_t count_ = 0, repeated_ = 0;
  mutable std::unique_ptr<std::ifstream> open_;  // the file that was read last
  mutable std::size_t open_file_ = 0;
};

// The file that this process appends to.
class Journal {
 public:
  // Refuses a folder whose file another process is writing.
  Journal(const std::string& folder, const Shard& shard);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  const std::string& path() const { return path_; }
  void cut(std::size_t bytes);            // a torn last line
  void append(const std::string& lines);  // refuses when it cannot be written whole; then nothing of it is there
  void sync();

 private:
  std::string path_;
  FileLock lock_;
  int file_ = -1;
  std::int64_t size_ = 0;
  bool synced_ = true;
  std::chrono::steady_clock::time_point last_sync_;
};

}  // namespace slipstream
