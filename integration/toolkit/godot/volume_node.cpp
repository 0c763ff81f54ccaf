#include <chrono>

#include "nodes.h"

namespace palpate::godot {
namespace {

/// Draws the picture over the whole viewport, after the engine's opaque surfaces: what of these is
/// nearer hides it. Where the volume is thin, so that no depth says where it is, its middle counts.
/// In a headset the head has moved since the picture was drawn: each place of the volume is looked
/// up in the picture where it was then.
constexpr const char* kShader = R"(
shader_type spatial;
render_mode unshaded, blend_premul_alpha, depth_test_disabled, depth_draw_never, cull_disabled,
    fog_disabled, shadows_disabled;
uniform sampler2D colours : source_color, filter_linear, repeat_disable;
uniform sampler2D depths : filter_nearest, repeat_disable;
uniform sampler2D right_colours : source_color, filter_linear, repeat_disable;
uniform sampler2D right_depths : filter_nearest, repeat_disable;
uniform sampler2D engine_depths : hint_depth_texture, filter_nearest;
uniform float metres = 1.0;
uniform float middle = 1.0;
uniform bool in_headset = false;
uniform mat4 eye_from_world;
uniform mat4 right_eye_from_world;
uniform vec4 tangents;  // of the left, right, lower and upper border
uniform vec4 right_tangents;
float depth_at(bool is_right, vec2 place) {
  float depth = metres * (is_right ? texture(right_depths, place) : texture(depths, place)).r;
  return depth == 0.0 ? middle : depth;
}
vec2 place_of(vec3 seen, vec4 borders) {
  return vec2((seen.x / -seen.z - borders.x) / (borders.y - borders.x),
              (borders.w - seen.y / -seen.z) / (borders.w - borders.z));
}
void vertex() { POSITION = vec4(2.0 * VERTEX.xy, 1.0, 1.0); }
void fragment() {
  float engine_depth = texture(engine_depths, SCREEN_UV).r;
#if CURRENT_RENDERER == RENDERER_COMPATIBILITY
  engine_depth = 2.0 * engine_depth - 1.0;
#endif
  vec4 surface = INV_PROJECTION_MATRIX * vec4(2.0 * SCREEN_UV - 1.0, engine_depth, 1.0);
  bool is_right = VIEW_INDEX == 1;
  vec2 place = SCREEN_UV;
  float depth = depth_at(is_right, place);
  if (in_headset) {
    vec4 near = INV_PROJECTION_MATRIX * vec4(2.0 * SCREEN_UV - 1.0, 1.0, 1.0);
    vec3 ray = near.xyz / near.w - EYE_OFFSET;
    mat4 then_from_now = (is_right ? right_eye_from_world : eye_from_world) * INV_VIEW_MATRIX;
    vec3 from = (then_from_now * vec4(EYE_OFFSET, 1.0)).xyz;
    vec3 along = mat3(then_from_now) * ray;
    vec4 borders = is_right ? right_tangents : tangents;
    float way = 0.0;
    depth = middle;
    // With the depth that stands there the place is right to second order.
    for (int step = 0; step < 3; ++step) {
      way = (depth + from.z) / -along.z;
      place = place_of(from + way * along, borders);
      depth = depth_at(is_right, place);
    }
    if (any(notEqual(place, clamp(place, 0.0, 1.0)))) discard;
    depth = -(EYE_OFFSET + way * ray).z;
  }
  if (-surface.z < depth * surface.w) discard;
  vec4 colour = is_right ? texture(right_colours, place) : texture(colours, place);
  ALBEDO = colour.rgb;
  ALPHA = colour.a;
}
)";

enum VolumeProperty : size_t { kLook, kDrawsHand, kDrawsBox, kCutOpen, kResolution };
constexpr int kPixels = 5, kFloats = 8;  // Image.FORMAT_RGBA8, FORMAT_RF

Variant made_object(const char* class_name) {
  return singleton("ClassDB").call("instantiate", class_name);
}

struct EngineQuaternion {
  float x = 0.0F, y = 0.0F, z = 0.0F, w = 1.0F;
};
struct EnginePair {
  float x = 0.0F, y = 0.0F;
};

/// The size of the viewport's picture; in a headset that of each eye.
EnginePair picture_size(const Variant& viewport, bool in_headset) {
  EnginePair size;
  (in_headset ? singleton("XRServer").call("get_primary_interface").call("get_render_target_size")
              : viewport.call("get_texture").call("get_size"))
      .copy_to(&size);
  return size;
}

/// first^-1 second: the rotation of the second place as the first sees it, x, y, z, w.
std::array<double, 4> rotation_between(const EngineTransform& first,
                                       const EngineTransform& second) {
  const auto of = [](const EngineTransform& t) {
    const auto column = [&](size_t c) {
      return EngineVector{t.rows[0][c], t.rows[1][c], t.rows[2][c]};
    };
    EngineQuaternion q;
    Variant::made(GDEXTENSION_VARIANT_TYPE_BASIS, column(0), column(1), column(2))
        .call("get_rotation_quaternion")
        .copy_to(&q);
    return q;
  };
  const EngineQuaternion a = of(first), b = of(second);
  std::array<double, 4> xyzw{
      a.w * b.x - a.x * b.w - a.y * b.z + a.z * b.y, a.w * b.y - a.y * b.w - a.z * b.x + a.x * b.z,
      a.w * b.z - a.z * b.w - a.x * b.y + a.y * b.x, a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z};
  double square = 0.0;
  for (const double part : xyzw) square += part * part;
  for (double& part : xyzw) part /= std::sqrt(square);
  return xyzw;
}

}  // namespace

VolumeNode::~VolumeNode() {
  close();
}

Variant VolumeNode::get(size_t property) const {
  const Variant values[] = {look_, draws_hand_, draws_box_, cut_open_, shadows_, resolution_};
  return values[property];
}

void VolumeNode::set(size_t property, const Variant& value) {
  Variant* const values[] = {&look_,     &draws_hand_, &draws_box_,
                             &cut_open_, &shadows_,    &resolution_};
  *values[property] = value;
  close();
}

void VolumeNode::close() {
  if (opening_.valid()) opening_.get();
  pal_view_close(&view_);
}

/// Uploads the data on a thread of its own.
void VolumeNode::open(uint32_t width, uint32_t height, uint32_t eye_count) {
  close();
  eye_count_ = eye_count;
  width_ = width;
  height_ = height;
  of_session_ = scene_->session();
  PalViewInfo info{};
  info.size = sizeof info;
  info.flags = PAL_VIEW_NO_BACKGROUND;
  if (!draws_hand_.is_true() || in_editor()) info.flags |= PAL_VIEW_NO_HAND;
  if (!draws_box_.is_true()) info.flags |= PAL_VIEW_NO_BOX;
  if (!shadows_.is_true()) info.flags |= PAL_VIEW_NO_SHADOWS;
  if (cut_open_.is_true()) info.flags |= PAL_VIEW_CUT_OPEN;
  info.width = width;
  info.height = height;
  info.eye_count = eye_count;
  opening_ = std::async(std::launch::async, [this, info, look = look_.text()]() mutable {
    info.look = look.c_str();
    return pal_view_open(of_session_, &info, &view_) == PAL_OK ? std::string() : pal_last_error();
  });
}

/// The images, and the surface that shows them.
void VolumeNode::make_screen() {
  const auto texture_of = [&](int format) {
    const Variant bytes = Variant::made(GDEXTENSION_VARIANT_TYPE_PACKED_BYTE_ARRAY);
    bytes.call("resize", int64_t(4) * width_ * height_);
    const ScreenTexture made{made_object("Image"), made_object("ImageTexture")};
    made.image.call("set_data", int(width_), int(height_), false, format, bytes);
    made.texture.call("set_image", made.image);
    return made;
  };
  if (material_.is_null()) {
    const Variant shader = made_object("Shader");
    shader.call("set_code", kShader);
    material_ = made_object("ShaderMaterial");
    material_.call("set_shader", shader);
    const Variant quad = made_object("QuadMesh");
    quad.call("set_material", material_);
    screen_ = made_object("MeshInstance3D");
    screen_.call("set_mesh", quad);
    // Seen from everywhere.
    screen_.call("set_extra_cull_margin", 16384.0);
    constexpr int kInternalBack = 2;
    self().call("add_child", screen_, false, kInternalBack);
  }
  // A second eye is a headset's right one.
  for (uint32_t e = 0; e < eye_count_; ++e) {
    colours_[e] = texture_of(kPixels);
    depths_[e] = texture_of(kFloats);
    const std::string of_eye = e == 0 ? "" : "right_";
    material_.call("set_shader_parameter", of_eye + "colours", colours_[e].texture);
    material_.call("set_shader_parameter", of_eye + "depths", depths_[e].texture);
  }
}

/// The corners of the boxes of all volumes, in palpate's world.
std::vector<HandPoint> VolumeNode::corners() const {
  std::vector<HandPoint> found;
  PalVolume volume{};
  volume.size = sizeof volume;
  PalVolumeState now{};
  now.size = sizeof now;
  for (uint32_t v = 0; pal_scene_volume(scene_->scene(), v, &volume) == PAL_OK &&
                       pal_session_volume(scene_->session(), v, &now) == PAL_OK;
       ++v)
    for (int corner = 0; corner < 8; ++corner) {
      HandPoint place{}, at{};
      for (size_t a = 0; a < 3; ++a) {
        place[a] = volume.corner_m[a];
        for (size_t edge = 0; edge < 3; ++edge)
          if (corner >> edge & 1) place[a] += volume.edges_m[3 * edge + a];
      }
      for (size_t row = 0; row < 3; ++row) {
        at[row] = now.world_from_volume[4 * row + 3];
        for (size_t a = 0; a < 3; ++a) at[row] += now.world_from_volume[4 * row + a] * place[a];
      }
      found.push_back(at);
    }
  return found;
}

/// The middle of what contains these, along the world's axes.
static void find_middle(const std::vector<HandPoint>& places, double (&middle)[3]) {
  HandPoint low{1e9, 1e9, 1e9}, high{-1e9, -1e9, -1e9};
  for (const HandPoint& place : places)
    for (size_t a = 0; a < 3; ++a) {
      low[a] = std::min(low[a], place[a]);
      high[a] = std::max(high[a], place[a]);
    }
  for (size_t a = 0; a < 3; ++a) middle[a] = 0.5 * (low[a] + high[a]);
}

/// Where the viewport has no camera: one before the volumes, as `palpate view` has it.
void VolumeNode::add_camera() {
  constexpr double kHeightAngle = 0.55, kFilled = 0.93;
  constexpr double kAway[3] = {0.42, 0.30, 1.0};
  const Variant camera = made_object("Camera3D");
  self().call("add_child", camera, false, 2);
  camera.call("set_fov", kHeightAngle * 180.0 / 3.14159265358979);
  camera.call("set_near", 0.005);
  const std::vector<HandPoint> ends = corners();
  double middle[3];
  find_middle(ends, middle);
  // Axes of a camera that looks at the middle from there.
  const double length = std::sqrt(kAway[0] * kAway[0] + kAway[1] * kAway[1] + kAway[2] * kAway[2]);
  const double back[3] = {kAway[0] / length, kAway[1] / length, kAway[2] / length};
  const double flat = std::hypot(back[0], back[2]);
  const double right[3] = {back[2] / flat, 0.0, -back[0] / flat};
  const double up[3] = {back[1] * right[2], back[2] * right[0] - back[0] * right[2],
                        -back[1] * right[0]};
  const double tan_up = std::tan(0.5 * kHeightAngle), tan_right = tan_up * width_ / height_;
  double distance = 1e-6;
  for (const HandPoint& end : ends) {
    double x = 0.0, y = 0.0, z = 0.0;
    for (size_t a = 0; a < 3; ++a) {
      const double at = end[a] - middle[a];
      x += at * right[a];
      y += at * up[a];
      z += at * back[a];
    }
    const double needed =
        std::max(std::abs(x) / (kFilled * tan_right), std::abs(y) / (kFilled * tan_up));
    distance = std::max(distance, needed + z);
  }
  double place[3];
  for (size_t a = 0; a < 3; ++a) place[a] = middle[a] + distance * back[a];
  camera.call("look_at_from_position", scene_->placed(place), scene_->placed(middle));
  camera.call("make_current");
}

/// An eye of the viewport's picture, from where it is in Godot's world.
PalEye VolumeNode::eye_at(const EngineTransform& place, const EngineProjection& projection) const {
  PalEye eye{};
  const HandPoint at_m = scene_->in_palpate(place.origin);
  const std::array<double, 4> turn = rotation_between(scene_->transform(), place);
  std::copy(at_m.begin(), at_m.end(), eye.position_m);
  std::copy(turn.begin(), turn.end(), eye.orientation);
  const double x = projection.columns[0][0], y = projection.columns[1][1];
  eye.tan_left = (projection.columns[2][0] - 1.0) / x;
  eye.tan_right = (projection.columns[2][0] + 1.0) / x;
  eye.tan_down = (projection.columns[2][1] - 1.0) / y;
  eye.tan_up = (projection.columns[2][1] + 1.0) / y;
  return eye;
}

void VolumeNode::draw(const Variant& camera) {
  PalEye eyes[2];
  const bool in_headset = eye_count_ == 2;
  material_.call("set_shader_parameter", "in_headset", in_headset);
  if (!in_headset) {
    eyes[0] = eye_at(camera.call("get_camera_transform").as<EngineTransform>(),
                     camera.call("get_camera_projection").as<EngineProjection>());
  } else {
    const Variant server = singleton("XRServer"), headset = server.call("get_primary_interface");
    const double aspect = double(width_) / height_;
    for (uint32_t e = 0; e < 2; ++e) {
      const Variant place =
          headset.call("get_transform_for_view", int(e), server.call("get_world_origin"));
      const Variant projection = headset.call("get_projection_for_view", int(e), aspect,
                                              camera.call("get_near"), camera.call("get_far"));
      PalEye& eye = eyes[e] =
          eye_at(place.as<EngineTransform>(), projection.as<EngineProjection>());
      const std::string of_eye = e == 0 ? "" : "right_";
      material_.call("set_shader_parameter", of_eye + "eye_from_world",
                     place.call("affine_inverse"));
      material_.call("set_shader_parameter", of_eye + "tangents",
                     Variant::made(GDEXTENSION_VARIANT_TYPE_VECTOR4, eye.tan_left, eye.tan_right,
                                   eye.tan_down, eye.tan_up));
    }
  }
  const PalResult drawn = pal_view_render(view_, eyes, eye_count_, width_, height_, 0.0, nullptr);
  if (drawn == PAL_NOT_YET) return;
  bool is_read = drawn == PAL_OK;
  for (uint32_t e = 0; e < eye_count_ && is_read; ++e) {
    const auto memory_of = [](const Variant& image) {
      return engine.image_ptrw(image.as<GDExtensionObjectPtr>());
    };
    is_read = pal_view_read(view_, e, reinterpret_cast<uint32_t*>(memory_of(colours_[e].image)),
                            reinterpret_cast<float*>(memory_of(depths_[e].image))) == PAL_OK;
    for (const ScreenTexture* const screen : {&colours_[e], &depths_[e]})
      screen->texture.call("update", screen->image);
  }
  if (!is_read) {
    fail(pal_last_error());
    return;
  }
  double middle[3];
  find_middle(corners(), middle);
  const auto seen = camera.call("to_local", scene_->placed(middle)).as<EngineVector>();
  material_.call("set_shader_parameter", "middle", double(-seen.z));
  const EngineTransform t = scene_->transform();
  material_.call("set_shader_parameter", "metres",
                 std::hypot(double(t.rows[0][0]), double(t.rows[1][0]), double(t.rows[2][0])));
  screen_.call("set_visible", true);
  if (!std::exchange(is_shown_, true)) emit("shown");
}

void VolumeNode::fail(const std::string& sentence) {
  has_failed_ = true;
  warn(sentence);
  emit("failed", sentence);
}

void VolumeNode::process() {
  PalSession* const session = scene_ ? scene_->session() : nullptr;
  if (session != of_session_) {
    close();
    of_session_ = session;
    has_failed_ = is_shown_ = false;
    if (!screen_.is_null()) screen_.call("set_visible", false);
  }
  if (!session || has_failed_ || !scene_->state() || !self().call("is_visible_in_tree").is_true())
    return;
  const Variant viewport = in_editor()
                               ? singleton("EditorInterface").call("get_editor_viewport_3d", 0)
                               : self().call("get_viewport");
  const bool in_headset = viewport.call("is_using_xr").is_true();
  const EnginePair size = picture_size(viewport, in_headset);
  const double share = resolution_.number();
  const auto width = uint32_t(std::max(1.0, share * size.x));
  const auto height = uint32_t(std::max(1.0, share * size.y));
  if (opening_.valid()) {
    if (opening_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
    if (const std::string trouble = opening_.get(); !trouble.empty()) {
      fail(trouble);
      return;
    }
    make_screen();
  }
  const uint32_t eye_count = in_headset ? 2 : 1;
  if (!view_ || width != width_ || height != height_ || eye_count != eye_count_) {
    open(width, height, eye_count);
    return;
  }
  const Variant camera = viewport.call("get_camera_3d");
  if (camera.as<GDExtensionObjectPtr>()) {
    draw(camera);
    return;
  }
  if (in_editor()) return;
  add_camera();
}

void VolumeNode::notified(int what) {
  if (what == kEntersTree) {
    scene_ = SceneNode::above(*this);
    if (!scene_) warn("A PalpateVolume stands below a PalpateScene");
    // After the hand, and after all scripts that move the camera.
    self().call("set_process_priority", 200);
    const bool has_pictures = singleton("DisplayServer").call("get_name").text() != "headless";
    self().call("set_process_internal", has_pictures);
  }
  if (what == kInternalProcess) process();
  if (what == kLeavesTree) {
    close();
    scene_ = nullptr;
    of_session_ = nullptr;
  }
}

const ClassRow& VolumeNode::class_row() {
  constexpr auto kBool = GDEXTENSION_VARIANT_TYPE_BOOL;
  constexpr auto kString = GDEXTENSION_VARIANT_TYPE_STRING;
  static const ClassRow row{
      "PalpateVolume",
      "Node3D",
      "The picture of the PalpateScene above, in the viewport of this node.",
      []() -> std::unique_ptr<EngineNode> { return std::make_unique<VolumeNode>(); },
      {},
      {{"shown", {}}, {"failed", {{"sentence", kString}}}},
      {{.name = "look",
        .type = kString,
        .help = "Transfer function, as the program's option: auto, CT bone, CT heart, CT lung, MR, "
                "phantom, molecule, flow, heart"},
       {.name = "draws_hand", .type = kBool, .help = "Pen, proxy and force"},
       {.name = "draws_box",
        .type = kBool,
        .help = "Edges of the data, and letters of the patient's sides"},
       {.name = "cut_open",
        .type = kBool,
        .help = "Nothing is drawn between the eye and a plane through the touched place"},
       {.name = "shadows",
        .type = kBool,
        .help = "Ambient occlusion and soft shadows of the volumes"},
       {.name = "resolution",
        .type = GDEXTENSION_VARIANT_TYPE_FLOAT,
        .hint = 1,
        .hint_text = "0.1,1,0.01",
        .help = "Of the picture, as a share of the viewport's along each edge"}}};
  return row;
}

}  // namespace palpate::godot
