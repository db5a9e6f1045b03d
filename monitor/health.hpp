// What is wrong with the sensors of one estimator, as its record grows: live and at the end the same.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "monitor/diagnosis.hpp"

namespace slipstream {

class Health {
 public:
  // Reads what the record has got since the last call: amortised constant time a measurement, because a diagnosis that looks at
  // a whole episode is made when it begins, whenever it has doubled, and at its end.
  void update(const EstimatorRecord& r);

  // Everything that was found, those that go on with the newest numbers: makes the diagnosis anew.
  std::vector<Finding> findings(const EstimatorRecord& r) const;

  // As far as it is known: of the newest diagnosis, those that go on.
  const std::vector<std::string>& present() const { return present_; }

  // What is worth a line and was not said yet: a beginning, a cause that is now known, an end. At most 40 in a run.
  std::vector<std::string> take_news();

 private:
  struct Watched {
    SensorWatch watch;
    std::size_t next = 0;
    int episodes = 0;
    bool was_alarmed = false, was_silent = false;
    std::size_t diagnose_at = 0;  // measurements
  };
  void follow(const EstimatorRecord& r, std::size_t row, const std::string& sensor, Watched& w);
  void listen(Utime now, const std::string& sensor, Watched& w);
  void examine(const EstimatorRecord& r);
  void tell(const std::string& key, const std::string& line);

  std::size_t next_row_ = 0;
  std::map<std::string, Watched> watched_;
  std::vector<Ailing> ailing_;     // every episode
  std::vector<Finding> silences_;  // every silence
  bool is_due_ = false;
  std::vector<std::string> present_, news_;
  std::set<std::string> said_;
};

}  // namespace slipstream
