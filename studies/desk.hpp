// Where a study's items are handed out and their lines come in: the same for processes on this machine and for ranks of MPI.
//
// What earlier calls have finished is not handed out again, but for one item: if that comes out differently, the program is
// another one than before, and mixing the two would be wrong.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>

#include "studies/journal.hpp"
#include "studies/summary.hpp"

namespace slipstream {

class Desk {
 public:
  using Say = std::function<void(const std::string& line)>;

  // Claims the folder. `say` tells what was found there.
  Desk(const Study& study, const std::string& folder, const Shard& shard, const Say& say);

  std::optional<std::size_t> next();  // an item to do
  void finished(std::size_t item, const std::string& line);
  void failed(std::size_t item, const std::string& error);
  void flush();  // what came in goes to the file: call often
  void close();  // and is on the disk

  std::size_t done() const { return known_ + finished_; }  // with those of earlier calls
  std::size_t finished_here() const { return finished_; }
  std::size_t all() const { return all_; }                                          // of this shard
  const std::map<std::size_t, std::string>& failures() const { return failures_; }  // item and reason

 private:
  const Study& study_;
  Shard shard_;
  Say say_;
  std::optional<Journal> journal_;
  std::vector<bool> have_;
  std::size_t at_ = 0, all_ = 0, known_ = 0, finished_ = 0;
  std::optional<std::size_t> repeat_;  // the item that is done again
  std::string repeated_line_, repeated_place_;
  bool repeat_given_ = false;
  std::string unwritten_;
  std::map<std::size_t, std::string> failures_;
};

// What is there of the files, summed in index order.
Summary summarise(const Study& study, const KnownRuns& known);

// results.json and timings.json.
void write_summary(const std::string& folder, const Study& study, const Summary& summary);

// "items 3, 17, 20 and 5 more".
std::string some_items(const std::vector<std::size_t>& items);

}  // namespace slipstream
