#include "plant/drive_messages.hpp"

namespace slipstream {

DriveMessages::DriveMessages(const std::vector<std::string>& quantities, std::int64_t run_id)
    : quantities_(quantities), channel_seq_(quantities.size(), 0) {
  tick_.header.run_id = truth_.header.run_id = reading_.header.run_id = run_id;
}

void DriveMessages::publish(const DriveEpoch& epoch, Sink& sink) {
  for (const NamedValue& r : epoch.readings) {
    const auto channel = static_cast<std::size_t>(r.channel);
    reading_.header.utime = r.utime;
    reading_.header.seq = channel_seq_[channel]++;
    reading_.quantity = quantities_[channel];
    reading_.value = r.value;
    sink.publish(reading_);
  }
  tick_.header.utime = epoch.utime;
  if (epoch.truth.empty()) return;
  truth_.header.utime = epoch.utime;
  truth_.value = epoch.truth;
  sink.publish(truth_);
  ++truth_.header.seq;
}

void DriveMessages::publish_tick(RunState state, Sink& sink) {
  tick_.state = state;
  sink.publish(tick_);
  ++tick_.header.seq;
}

Tick DriveMessages::newest_tick() const {
  Tick newest = tick_;
  --newest.header.seq;  // publish_tick has counted on
  return newest;
}

RunDescriptor descriptor_of(const DriveSource& drive, std::int64_t run_id, const std::string& name,
                            const std::string& scenario_toml, const std::string& clock) {
  return {{0, 0, run_id}, name, scenario_toml, clock, drive.truth_names(), drive.truth_units()};
}

Utime publish_whole(DriveSource& drive, const RunDescriptor& descriptor, Sink& sink) {
  sink.publish(descriptor);
  DriveMessages messages(drive.quantities(), descriptor.header.run_id);
  DriveEpoch epoch;
  Utime last = 0;
  while (drive.next(epoch)) {
    last = epoch.utime;
    messages.publish(epoch, sink);
    messages.publish_tick(RunState::kRunning, sink);
  }
  messages.publish_tick(RunState::kEnded, sink);
  return last;
}

}  // namespace slipstream
