#include "integration/web/live_page.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <glm/gtc/type_ptr.hpp>
#include <nlohmann/json.hpp>

#include "compute/vulkan/caught.h"
#include "integration/web/embedded.h"
#include "integration/web/qr_code.h"
#include "module/haptics/servo/real_time.h"

namespace palpate::web {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

constexpr auto kStates = 33ms, kPacks = 500ms;

/// The numbers of a vector, rounded to a millionth.
json rounded(glm::dvec3 v) {
  json list = json::array();
  for (int a = 0; a < 3; ++a) list.push_back(std::round(1e6 * v[a]) * 1e-6);
  return list;
}

WebReply file(std::string_view type, Embedded which) {
  return {type, std::make_shared<const std::string>(embedded(which))};
}

}  // namespace

Result<std::unique_ptr<LivePage>> LivePage::start(LivePageOptions options) {
  std::unique_ptr<LivePage> page(new LivePage);
  page->options_ = std::move(options);
  HttpsServerOptions server;
  server.address = page->options_.address;
  server.port = page->options_.port;
  server.certificate_valid = page->options_.certificate_valid;
  server.get = [page = page.get()](std::string_view path) { return page->get(path); };
  server.on_join = [](uint64_t client) { return json{{"you", client}}.dump(); };
  server.on_leave = [page = page.get()](uint64_t client) {
    if (page->holder_ == client) page->let_go();
  };
  server.on_text = [page = page.get()](uint64_t client, const std::string& text) {
    return page->take(client, text);
  };
  server.on_tick = [page = page.get()] {
    if (page->holder_ != 0 && std::chrono::steady_clock::now() - page->heard_at_ > kSilence)
      page->let_go();
  };
  server.on_certificate = [page = page.get()](const Certificate& renewed) {
    if (page->options_.on_note)
      page->options_.on_note("The page has a new certificate, SHA-256 " + renewed.fingerprint);
  };
  auto started = HttpsServer::start(std::move(server));
  if (!started) return started.error();
  page->server_ = std::move(*started);
  {
    const std::lock_guard lock(page->mutex_);
    page->address_picture_ =
        std::make_shared<const std::string>(qr_svg(page->server_->page_addresses().back()));
  }
  return page;
}

void LivePage::begin(Session& session, PositionSource* hand) {
  {
    const std::lock_guard lock(mutex_);
    session_ = &session;
    hand_ = hand;
  }
  states_ = std::make_unique<Background>(kStates, [this] {
    (void)caught([&]() -> Status {
      send_state();
      return Nothing{};
    });
  });
  packs_ = std::jthread([this](std::stop_token stop) {
    give_way(BackgroundWork::kEstimation);
    const Status packed = caught([&]() -> Status {
      pack(stop);
      return Nothing{};
    });
    if (!packed && options_.on_note)
      options_.on_note("The page shows no further changes: " + packed.error().message);
  });
}

void LivePage::end() {
  packs_.request_stop();
  if (packs_.joinable()) packs_.join();
  states_.reset();
  // From here on no client moves the hand.
  server_.reset();
}

void LivePage::set_note(const std::string& note) {
  const std::lock_guard lock(mutex_);
  note_ = note;
}

WebReply LivePage::get(std::string_view path) {
  if (path.empty()) return file("text/html; charset=utf-8", Embedded::kLivePage);
  if (path == "live.js") return file("text/javascript", Embedded::kLiveScript);
  if (path == "live_view.js") return file("text/javascript", Embedded::kLiveView);
  if (path == "live.css") return file("text/css", Embedded::kLiveStyle);
  const std::lock_guard lock(mutex_);
  if (path == "address.svg") return {"image/svg+xml", address_picture_};
  if (path == "scene") return {"application/json", description_};
  constexpr std::string_view kPart = "part/";
  uint64_t number = 0;
  if (!path.starts_with(kPart)) return {};
  path.remove_prefix(kPart.size());
  const auto read = std::from_chars(path.data(), path.data() + path.size(), number);
  const auto found = parts_.find(number);
  if (read.ec != std::errc() || read.ptr != path.data() + path.size() || found == parts_.end())
    return {};
  return {"application/octet-stream", found->second};
}

std::string LivePage::take(uint64_t client, const std::string& text) {
  const json said = json::parse(text, nullptr, false);
  if (!said.is_object() || said.size() != 1) return "A message that is no JSON object with one key";
  const std::string& key = said.begin().key();
  const json& value = said.begin().value();
  Session* session = nullptr;
  {
    const std::lock_guard lock(mutex_);
    session = session_;
  }
  if (key == "hand") {
    if (value.is_null()) {
      if (holder_ == client) let_go();
      return {};
    }
    glm::dvec3 place(0.0);
    bool is_place = value.is_array() && value.size() == 3;
    for (size_t a = 0; is_place && a < 3; ++a) {
      is_place = value[a].is_number() && std::isfinite(value[a].get<double>()) &&
                 std::abs(value[a].get<double>()) < double(kAbsurdM);
      if (is_place) place[int(a)] = value[a].get<double>();
    }
    if (!is_place) return "A hand is no list of three numbers in metres";
    take_hand(client, place);
    return {};
  }
  if (key == "play") {
    if (!value.is_boolean()) return "'play' is neither true nor false";
    if (session) session->play(value.get<bool>());
    return {};
  }
  if (key == "scrub") {
    if (!value.is_number() || !(value.get<double>() >= 0.0 && value.get<double>() <= 1.0))
      return "'scrub' is no number from 0 to 1";
    if (session) session->scrub_to(value.get<double>());
    return {};
  }
  return "A message with a key that is not known";
}

void LivePage::take_hand(uint64_t client, glm::dvec3 world_m) {
  PositionSource* hand = nullptr;
  Transform place;
  {
    const std::lock_guard lock(mutex_);
    if (generation_ > 0) hand = hand_;  // its space is known
    place = world_from_device_;
  }
  if (!hand || (holder_ != 0 && holder_ != client)) return;
  holder_ = client;
  heard_at_ = std::chrono::steady_clock::now();
  hand->hold(place.volume_from_world(world_m), 0);
}

void LivePage::let_go() {
  holder_ = 0;
  const std::lock_guard lock(mutex_);
  if (hand_) hand_->let_go();
}

void LivePage::pack(std::stop_token stop) {
  LiveScene scene(options_.view);
  while (!stop.stop_requested()) {
    SceneSnapshot snapshot;
    {
      const std::lock_guard lock(mutex_);
      snapshot = snapshot_;
    }
    if (snapshot.volume_count > 0) {
      const auto felt = session_->scene();
      if (scene.update(felt, snapshot)) {
        json description = json::parse(scene.description());
        const std::lock_guard lock(mutex_);
        ++generation_;
        if (description.is_object()) {
          description["title"] = options_.title;
          description["generation"] = generation_;
          description["can_touch"] = hand_ != nullptr;
        }
        description_ = std::make_shared<const std::string>(description.dump());
        parts_ = scene.parts();
        volume_ = scene.volume();
        world_from_device_ = felt->world_from_device;
      }
    }
    for (auto waited = 0ms;
         waited < (generation_ == 0 ? kStates : kPacks) && !stop.stop_requested();
         waited += kStates)
      std::this_thread::sleep_for(kStates);
  }
}

void LivePage::send_state() {
  SceneSnapshot snapshot;
  if (!session_->newest(SnapshotReader::kPage, snapshot)) return;
  json state;
  {
    const std::lock_guard lock(mutex_);
    snapshot_ = snapshot;
    state["scene"] = generation_;
    if (!note_.empty()) state["note"] = note_;
    if (volume_ >= 0 && volume_ < snapshot.volume_count) {
      const VolumeSnapshot& of = snapshot.volumes[size_t(volume_)];
      const glm::dmat4 place = matrix(of.world_from_volume);
      state["time_s"] = of.time_s;
      state["rate"] = of.rate;
      state["place"] = std::vector<double>(glm::value_ptr(place), glm::value_ptr(place) + 16);
    }
  }
  const uint64_t holder = holder_;
  state["holder"] = holder;
  state["can_play"] = session_->can_play();
  state["probe_m"] = rounded(snapshot.probe_m);
  state["proxy_m"] = rounded(snapshot.proxy_m);
  state["force_n"] = rounded(snapshot.force_n);
  state["touches"] = snapshot.in_contact;
  if (snapshot.cause != Cause::kNone) state["cause"] = sentence(snapshot.cause);
  server_->send(std::make_shared<const std::string>(state.dump()));
}

}  // namespace palpate::web
