#pragma once

#include <palpate.h>

#include <atomic>
#include <deque>
#include <future>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "binding.h"
#include "hand_link.h"

namespace palpate::godot {

/// Handles of palpate, closed in the order that it wants.
struct OpenScene {
  PalContext* context = nullptr;
  PalScene* scene = nullptr;
  PalSession* session = nullptr;
  std::string trouble;  ///< why there is no session; empty: there is one

  OpenScene() = default;
  OpenScene(OpenScene&& other) noexcept { *this = std::move(other); }
  OpenScene& operator=(OpenScene&& other) noexcept {
    std::swap(context, other.context);
    std::swap(scene, other.scene);
    std::swap(session, other.session);
    std::swap(trouble, other.trouble);
    return *this;
  }
  ~OpenScene() {
    pal_session_close(&session);
    pal_scene_close(&scene);
    pal_context_close(&context);
  }
};

class HandNode;

/// PalpateScene: what is felt and seen. Its own space is palpate's world (m, y up). It opens the
/// data and a session on a thread of its own when it enters the tree, and closes them when it
/// leaves. All other calls are on the engine's main thread.
class SceneNode final : public EngineNode {
 public:
  SceneNode();
  ~SceneNode() override;
  static const ClassRow& class_row();
  /// The scene above a node, or null.
  static SceneNode* above(const EngineNode& node);

  void notified(int what) override;
  Variant get(size_t property) const override;
  void set(size_t property, const Variant& value) override;
  uint32_t usage_of(const std::string& property) const override;

  void open();
  void open_soon();
  void close();
  PalSession* session() const { return opened_.session; }
  const PalScene* scene() const { return opened_.scene; }
  /// Of the newest haptic frame; null: there was none.
  const PalState* state() const { return has_state_ ? &state_ : nullptr; }
  /// Godot's world from palpate's.
  EngineTransform transform() const;
  /// Where a place in palpate's world is, m in the device's space.
  HandPoint in_device(const HandPoint& palpate_m) const;
  /// A place in Godot's world, in palpate's.
  HandPoint in_palpate(EngineVector place) const;
  /// A direction or force along palpate's axes, along Godot's.
  EngineVector turned(const double (&palpate)[3]) const;
  /// A place in palpate's world, in Godot's.
  EngineVector placed(const double (&palpate_m)[3]) const;

  HandNode* hand = nullptr;
  HandLink link;

 private:
  struct Request;
  struct SceneEvent {
    PalEventKind kind;
    std::string sentence;
  };

  static OpenScene opened(const Request& request);
  static void on_event(void* user, PalEventKind kind, const char* sentence);
  std::string options_text(std::string_view stage) const;
  void take_opened();
  void process();

  // Methods of the class.
  Variant do_open(Arguments);
  Variant do_close(Arguments);
  Variant is_open(Arguments);
  Variant play(Arguments on);
  Variant scrub(Arguments share);
  Variant rearm(Arguments);
  Variant replay(Arguments recording);

  // Properties.
  Variant inputs_;
  Variant gpu_ = "";
  Variant autostart_ = true, preview_ = false;
  std::map<size_t, Variant> options_;  ///< by row; those that differ from the default

  std::future<OpenScene> opening_;
  OpenScene opened_;
  HandPoint device_translation_m_{}, device_scale_{1.0, 1.0, 1.0};
  std::array<double, 4> device_wxyz_{1.0, 0.0, 0.0, 0.0};
  PalState state_{};
  bool has_state_ = false;
  bool opens_ = false;  ///< with the next frame
  std::mutex events_mutex_;
  std::deque<SceneEvent> events_;
};

/// PalpateHand: its global position is the hand; or, with follows_device, it goes where the hand on
/// palpate's force device is.
class HandNode final : public EngineNode {
 public:
  static const ClassRow& class_row();
  void notified(int what) override;
  Variant get(size_t property) const override;
  void set(size_t property, const Variant& value) override;
  bool follows_device() const { return follows_device_.is_true(); }
  double reach_m() const { return reach_m_.number(); }

 private:
  void process();

  Variant follows_device_ = false;
  Variant reach_m_ = 0.08;
  SceneNode* scene_ = nullptr;
  EngineVector force_n_, proxy_;
  bool is_touching_ = false;
  std::string cause_;
};

/// PalpateVolume: the picture of the scene above, drawn by palpate for the camera of this node's
/// viewport and laid over what the engine draws, by depth.
class VolumeNode final : public EngineNode {
 public:
  ~VolumeNode() override;
  static const ClassRow& class_row();
  void notified(int what) override;
  Variant get(size_t property) const override;
  void set(size_t property, const Variant& value) override;

 private:
  /// An image in memory, and the engine's texture of it.
  struct ScreenTexture {
    Variant image, texture;
  };
  void open(uint32_t width, uint32_t height, uint32_t eye_count);
  void close();
  void make_screen();
  std::vector<HandPoint> corners() const;
  void add_camera();
  PalEye eye_at(const EngineTransform& place, const EngineProjection& projection) const;
  void draw(const Variant& camera);
  void fail(const std::string& sentence);
  void process();

  Variant look_ = "auto", draws_hand_ = true, draws_box_ = true, cut_open_ = false, shadows_ = true;
  Variant resolution_ = 1.0;
  SceneNode* scene_ = nullptr;
  PalSession* of_session_ = nullptr;  ///< which the view shows
  PalView* view_ = nullptr;
  std::future<std::string> opening_;
  bool has_failed_ = false, is_shown_ = false;
  uint32_t width_ = 0, height_ = 0, eye_count_ = 1;
  std::array<ScreenTexture, 2> colours_, depths_;  ///< by eye
  Variant material_, screen_;
};

}  // namespace palpate::godot
