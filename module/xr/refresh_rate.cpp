#include "module/xr/refresh_rate.h"

#include <algorithm>
#include <cmath>

namespace palpate::xr {

double highest_rate(std::span<const float> offered_hz, double needed_s) {
  double chosen_hz = *std::min_element(offered_hz.begin(), offered_hz.end());
  for (const double hz : offered_hz)
    if (hz * needed_s <= 1.0) chosen_hz = std::max(chosen_hz, hz);
  return chosen_hz;
}

double nearest_rate(std::span<const float> offered_hz, double wanted_hz) {
  return *std::min_element(offered_hz.begin(), offered_hz.end(), [&](double a, double b) {
    return std::abs(a - wanted_hz) < std::abs(b - wanted_hz);
  });
}

Outcome<RefreshRate> RefreshRate::make(const Instance& instance, const OpenXrSession& session,
                                       double wanted_hz) {
  RefreshRate made;
  made.instance_ = &instance;
  made.wanted_hz_ = wanted_hz;
  if (!instance.request_refresh_rate) return made;
  Done asked = made.ask(session);
  if (!asked) asked = made.refuse(asked.error());
  if (!asked) return asked.error();
  return made;
}

Done RefreshRate::ask(const OpenXrSession& session) {
  constexpr const char* kCall = "xrEnumerateDisplayRefreshRatesFB";
  uint32_t count = 0;
  Done asked =
      done(kCall, instance_->enumerate_refresh_rates(session.handle(), 0, &count, nullptr));
  if (!asked) return asked;
  std::vector<float> offered_hz(count);
  asked = done(kCall, instance_->enumerate_refresh_rates(session.handle(), count, &count,
                                                         offered_hz.data()));
  if (!asked) return asked;
  offered_hz.resize(count);
  float now_hz = 0.0F;
  asked = done("xrGetDisplayRefreshRateFB", instance_->get_refresh_rate(session.handle(), &now_hz));
  if (!asked) return asked;
  rate_.hz = now_hz;
  if (offered_hz.size() > 1) rate_.offered_hz = std::move(offered_hz);
  return Nothing{};
}

Done RefreshRate::step(const OpenXrSession& session, double needed_s) {
  if (rate_.offered_hz.empty() || rate_.chosen_hz > 0.0) return Nothing{};
  if (wanted_hz_ <= 0.0 && needed_s <= 0.0) return Nothing{};
  const double chosen_hz = wanted_hz_ > 0.0 ? nearest_rate(rate_.offered_hz, wanted_hz_)
                                            : highest_rate(rate_.offered_hz, needed_s);
  const Done asked = done("xrRequestDisplayRefreshRateFB",
                          instance_->request_refresh_rate(session.handle(), float(chosen_hz)));
  if (!asked) return refuse(asked.error());
  rate_.chosen_hz = chosen_hz;
  rate_.needed_s = wanted_hz_ > 0.0 ? 0.0 : needed_s;
  return Nothing{};
}

/// A loss is reported to the session; after any other error the rate stays as it is.
Done RefreshRate::refuse(const Problem& problem) {
  if (problem.trouble == Trouble::kSessionLost || problem.trouble == Trouble::kInstanceLost)
    return problem;
  rate_.refused = call_text(problem);
  rate_.offered_hz.clear();
  return Nothing{};
}

}  // namespace palpate::xr
