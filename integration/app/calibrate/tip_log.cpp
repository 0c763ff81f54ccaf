#include "integration/app/calibrate/tip_log.h"

namespace palpate::app {

TickOutput TipLog::tick(const TickInput& input) noexcept {
  const DeviceReading& reading = input.reading;
  fault_ = reading.fault;
  if (reading.fault == DeviceFault::kNone && reading.fresh)
    ring_.push({1e-9 * double(reading.time_ns), reading.position_m});
  TickOutput output;
  output.cause = Cause::kSceneEmpty;
  output.fault = reading.fault;
  return output;
}

void TipLog::drain(std::vector<TipSample>& samples) {
  for (TipSample sample; ring_.pop(sample);)
    if (samples.empty() || sample.time_s > samples.back().time_s) samples.push_back(sample);
}

}  // namespace palpate::app
