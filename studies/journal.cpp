#include "studies/journal.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/refusal.hpp"
#include "monitor/results.hpp"

namespace slipstream {
namespace {

namespace fs = std::filesystem;

constexpr std::chrono::milliseconds kUnsynced{900};
constexpr const char* kTakeOut = "take the line out and its run is repeated";

std::string text_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw Refusal(fmt::format("{}: cannot read: {}", path, std::strerror(errno)));
  std::ostringstream text;
  text << in.rdbuf();
  return std::move(text).str();
}

// Whole or not at all.
bool write_all(int file, const std::string& text) {
  for (std::size_t written = 0; written < text.size();) {
    const ssize_t n = ::write(file, text.data() + written, text.size() - written);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    written += static_cast<std::size_t>(n);
  }
  return true;
}

std::string this_process() {
  std::array<char, 256> host{};
  ::gethostname(host.data(), host.size() - 1);
  return fmt::format("process {} on {}", ::getpid(), host.data());
}

}  // namespace

std::string Shard::file() const { return of == 1 ? "runs.jsonl" : fmt::format("runs-{}-of-{}.jsonl", index, of); }

std::string study_head(const Study& study) { return fmt::format("# study {}", study.key); }

void claim_folder(const std::string& folder, const Study& study) {
  const std::string file = (fs::path(folder) / "study.toml").string(), scenarios = (fs::path(folder) / "scenarios").string();
  const std::string head = study_head(study);
  const auto require_same = [&] {
    std::string first;
    std::ifstream in(file);
    std::getline(in, first);
    if (first != head)
      throw Refusal(
          fmt::format("--out: {} holds another study (its study.toml says '{}', this one is '{}'); give this one a "
                      "folder of its own",
                      folder, first.substr(0, 40), head));
  };
  std::error_code error;
  if (fs::exists(file)) return require_same();
  if (fs::exists(folder) && !fs::is_directory(folder)) throw Refusal(fmt::format("--out: {} is not a folder", folder));
  if (!runs_files(folder).empty())
    throw Refusal(
        fmt::format("--out: {} holds runs but no study.toml that says of what; give this study another folder", folder));
  fs::create_directories(scenarios, error);
  if (error) throw Refusal(fmt::format("--out: cannot make the folder {}: {}", scenarios, error.message()));
  require_writable(folder);
  const FileLock lock = lock_folder(folder);
  if (fs::exists(file)) return require_same();
  for (const StudyScenario& s : study.scenarios) write_file((fs::path(scenarios) / (s.name + ".toml")).string(), s.toml);
  write_file(file, head + "\n" + study.resolved_toml);
}

std::vector<std::string> runs_files(const std::string& folder) {
  std::vector<std::string> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (name == "runs.jsonl" || (name.starts_with("runs-") && name.ends_with(".jsonl"))) files.push_back(entry.path().string());
  }
  std::sort(files.begin(), files.end());
  return files;
}

// Item and seed of a line that begins and ends as this study's do; what lies between is read when it is summed.
std::optional<std::pair<std::size_t, std::uint64_t>> KnownRuns::glance(const std::string& line) const {
  const std::string_view begin = "{\"study\":\"", item_key = "\",\"item\":", seed_key = ",\"seed\":";
  std::string_view rest(line);
  const auto take = [&rest](std::string_view expected) {
    const bool there = rest.starts_with(expected);
    if (there) rest.remove_prefix(expected.size());
    return there;
  };
  const auto number = [&rest](auto& to) {
    const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), to);
    rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
    return error == std::errc();
  };
  std::pair<std::size_t, std::uint64_t> found;
  const bool good = take(begin) && take(study_.key) && take(item_key) && number(found.first) && take(seed_key) &&
                    number(found.second) && rest.starts_with(",\"estimators\":{") && rest.ends_with("}}");
  return good ? std::optional(found) : std::nullopt;
}

std::size_t KnownRuns::read(const std::string& path) {
  const std::string text = text_of(path);
  files_.push_back(path);
  std::size_t line = 0, begin = 0;
  while (begin < text.size()) {
    ++line;
    const std::size_t end = text.find('\n', begin);
    if (end == std::string::npos) return text.size() - begin;
    const bool is_last = end + 1 == text.size();
    const std::string found = text.substr(begin, end - begin);
    const auto refuse = [&](const std::string& what) { throw Refusal(fmt::format("{}:{}: {}", path, line, what)); };
    auto run = is_last ? std::nullopt : glance(found);
    if (!run) {
      try {
        const RunLine whole = read_run_line(found);
        if (whole.study != study_.key)
          refuse(fmt::format("a run of another study ('{}', this one is '{}')", whole.study.substr(0, 20), study_.key));
        run = {whole.item, whole.seed};
      } catch (const NotARun& what) {
        if (is_last) return text.size() - begin;  // torn by what wrote it
        refuse(fmt::format("{}; {}", what.what(), kTakeOut));
      }
    }
    const auto [item, seed] = *run;
    if (item >= study_.items() || seed != study_.seed_of(study_.run_of(item)))
      refuse(fmt::format("item {} with seed {} is no run of this study", item, seed));
    if (!has(item)) {
      places_[item] = {files_.size() - 1, line, static_cast<std::int64_t>(begin), found.size()};
      ++count_;
    } else if (is_same_result(this->text(item), found)) {
      ++repeated_;
    } else {
      refuse(fmt::format("item {} differs from {}: one of them was made by another program", item, place(item)));
    }
    begin = end + 1;
  }
  return 0;
}

RunLine KnownRuns::run(std::size_t item) const {
  try {
    return read_run_line(text(item));
  } catch (const NotARun& what) {
    throw Refusal(fmt::format("{}: {}; {}", place(item), what.what(), kTakeOut));
  }
}

std::string KnownRuns::text(std::size_t item) const {
  const Place& at = places_[item].value();
  if (!open_ || open_file_ != at.file) {
    open_ = std::make_unique<std::ifstream>(files_[at.file], std::ios::binary);
    open_file_ = at.file;
  }
  std::string text(at.size, '\0');
  open_->seekg(at.begin);
  open_->read(text.data(), static_cast<std::streamsize>(at.size));
  if (!*open_) throw Refusal(fmt::format("{}: cannot read", place(item)));
  return text;
}

std::string KnownRuns::place(std::size_t item) const {
  return fmt::format("{}:{}", files_[places_[item]->file], places_[item]->line);
}

FileLock::FileLock(const std::string& path, const std::string& guarded, When when) {
  file_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (file_ < 0) throw Refusal(fmt::format("{}: cannot write: {}", path, std::strerror(errno)));
  struct flock whole = {};
  whole.l_type = F_WRLCK;
  int taken = 0;
  do {
    taken = ::fcntl(file_, when == When::kWait ? F_SETLKW : F_SETLK, &whole);
  } while (taken != 0 && errno == EINTR);
  if (taken != 0) {
    std::string holder;
    std::ifstream in(path);
    std::getline(in, holder);
    ::close(file_);
    throw Refusal(fmt::format("{} is being written by {}", guarded, holder.empty() ? "another process" : holder));
  }
  if (::ftruncate(file_, 0) != 0 || !write_all(file_, this_process() + "\n")) {
    // A full disk: the lock holds without a name.
  }
}

FileLock::~FileLock() { ::close(file_); }

FileLock lock_folder(const std::string& folder) {
  return FileLock((fs::path(folder) / ".study.lock").string(), folder, FileLock::When::kWait);
}

Journal::Journal(const std::string& folder, const Shard& shard)
    : path_((fs::path(folder) / shard.file()).string()),
      lock_((fs::path(folder) / ("." + fs::path(shard.file()).stem().string() + ".lock")).string(), path_,
            FileLock::When::kNow),
      last_sync_(std::chrono::steady_clock::now()) {
  file_ = ::open(path_.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0644);
  if (file_ < 0) throw Refusal(fmt::format("{}: cannot write: {}", path_, std::strerror(errno)));
  size_ = ::lseek(file_, 0, SEEK_END);
  const int entries = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);  // the file's name, too, survives a power cut
  if (entries < 0 || ::fsync(entries) != 0) {
    // A file system without it.
  }
  if (entries >= 0) ::close(entries);
}

Journal::~Journal() {
  ::fdatasync(file_);
  ::close(file_);
}

void Journal::cut(std::size_t bytes) {
  size_ -= static_cast<std::int64_t>(bytes);
  if (::ftruncate(file_, size_) != 0) throw Refusal(fmt::format("{}: cannot write: {}", path_, std::strerror(errno)));
}

void Journal::append(const std::string& lines) {
  if (lines.empty()) return;
  errno = 0;
  if (!write_all(file_, lines)) {
    const std::string why = std::strerror(errno == 0 ? ENOSPC : errno);
    if (::ftruncate(file_, size_) != 0) {
      // What is torn is cut off by the next call.
    }
    throw Refusal(fmt::format("{}: cannot write: {}; the runs before are kept, the same call goes on from there", path_, why));
  }
  size_ += static_cast<std::int64_t>(lines.size());
  synced_ = false;
  if (std::chrono::steady_clock::now() - last_sync_ > kUnsynced) sync();
}

void Journal::sync() {
  if (synced_) return;
  if (::fdatasync(file_) != 0) throw Refusal(fmt::format("{}: cannot write: {}", path_, std::strerror(errno)));
  synced_ = true;
  last_sync_ = std::chrono::steady_clock::now();
}

}  // namespace slipstream
