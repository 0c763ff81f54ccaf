#include "integration/files/scene/calibration_file.h"

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "integration/files/atomic_file.h"
#include "integration/files/scene/json_object.h"
#include "integration/files/sentences.h"

namespace palpate::files {
namespace {

namespace fs = std::filesystem;
using OrderedJson = nlohmann::ordered_json;
constexpr uintmax_t kMostCalibrationBytes = 1 << 16;

/// The four numbers of a rotation; refused unless of unit length to a thousandth, enough for
/// rounding and for edits by hand.
void read_rotation(JsonObject& object, glm::dquat& rotation) {
  constexpr const char* kKey = "quaternion_wxyz";
  const nlohmann::json* list = object.list(kKey);
  if (!list) {
    if (object.good()) object.refuse(kKey, "is missing: calibrate again");
    return;
  }
  double q[4] = {};
  bool good = list->size() == 4;
  for (size_t i = 0; good && i < 4; ++i) {
    good = (*list)[i].is_number();
    if (good) q[i] = (*list)[i].get<double>();
  }
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!good || !(std::abs(length - 1.0) < 1e-3))
    return object.refuse(kKey, "must be four numbers of a unit quaternion: calibrate again");
  rotation = glm::normalize(glm::dquat(q[0], q[1], q[2], q[3]));
}

void read_place(const nlohmann::json& value, JsonReading& reading, Pose& pose) {
  JsonObject object(value, "stage_from_device", reading);
  if (!object.vector("position_m", pose.position_m) && object.good())
    object.refuse("position_m", "is missing: calibrate again");
  if (object.good()) read_rotation(object, pose.rotation);
  object.finish();
}

StoredCalibration read(const nlohmann::json& root, JsonReading& reading) {
  StoredCalibration stored;
  Calibration& c = stored.calibration;
  JsonObject object(root, "", reading);
  const nlohmann::json* place = object.find("stage_from_device");
  if (!place) {
    if (object.good()) object.refuse("stage_from_device", "is missing: calibrate again");
    return stored;
  }
  read_place(*place, reading, c.stage_from_device);
  object.choice("space", stored.space,
                std::vector<std::pair<std::string_view, std::string>>{{"stage", "stage"},
                                                                      {"local", "local"}});
  double used = 0, all = 0;
  object.number("rms_m", c.rms_m, kNotNegative);
  object.number("used", used, kNotNegative);
  object.number("all", all, kNotNegative);
  object.number("delay_s", c.delay_s);
  object.vector("controller_from_tip_m", c.controller_from_tip_m);
  object.text("device", stored.device);
  object.text("headset", stored.headset);
  object.text("runtime", stored.runtime);
  object.finish();
  c.used = int(std::min(used, 1e9));
  c.all = int(std::min(all, 1e9));
  return stored;
}

}  // namespace

Status write_calibration(const fs::path& file, const StoredCalibration& stored) {
  const Calibration& c = stored.calibration;
  const glm::dquat& q = c.stage_from_device.rotation;
  OrderedJson root;
  root["stage_from_device"]["position_m"] = list_of(c.stage_from_device.position_m);
  root["stage_from_device"]["quaternion_wxyz"] = {q.w, q.x, q.y, q.z};
  root["space"] = stored.space;
  root["rms_m"] = c.rms_m;
  root["used"] = c.used;
  root["all"] = c.all;
  root["delay_s"] = c.delay_s;
  root["controller_from_tip_m"] = list_of(c.controller_from_tip_m);
  root["device"] = stored.device;
  root["headset"] = stored.headset;
  root["runtime"] = stored.runtime;
  return write_text(file, root.dump(2) + "\n");
}

Result<StoredCalibration> read_calibration(const fs::path& file) {
  std::error_code error;
  if (!fs::is_regular_file(file, error) || fs::file_size(file, error) > kMostCalibrationBytes)
    return bad_input(file, "is no calibration: make one with palpate calibrate.");
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  if (!stream) return bad_input(file, "can not be read: check its permissions.");
  return parse_calibration(file, text.str());
}

Result<StoredCalibration> parse_calibration(const fs::path& file, std::string_view text) {
  JsonReading reading{file, {}, nullptr};
  const auto root = parse_json(text, reading);
  if (!root) return *reading.error;
  StoredCalibration stored = read(*root, reading);
  if (reading.error) return *reading.error;
  return stored;
}

}  // namespace palpate::files
