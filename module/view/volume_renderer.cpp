#include "module/view/volume_renderer.h"

#include <algorithm>
#include <cmath>

#include "compute/vulkan/tried.h"
#include "module/view/kernels.h"
#include "module/view/light_grid.h"
#include "module/view/mesh_list.h"
#include "module/view/parameters.h"
#include "module/view/ray_lattice.h"
#include "module/view/shown_volume.h"
#include "module/view/thing_list.h"
#include "shaders/interface/view.h"

namespace palpate {

using namespace view_shaders;
using vulkan::Buffer;
using vulkan::tried;

namespace {

Error refused(const std::string& what) {
  return {ErrorKind::kBadInput, "This scene can not be drawn: " + what + "."};
}

// Light lost over one longer step, at most, where such are taken: what lies beside its one sample
// is then off by a part of this, and parts of many steps have either sign.
constexpr double kThinLoss = 0.01;

// Samples per voxel from which on a segment and the cell of its end are within half a brick.
constexpr double kShortSteps = 1.0 / 3.0;
constexpr size_t kMostGiven = 4;  // volumes of a scene; their segments come on top
constexpr double kMostSegmentOpacity = 0.99;
// Pixels along the edge of a voxel from which on rays are drawn for every second pixel first:
// nothing as large as two voxels lies between two such rays.
constexpr double kLeastVoxelPixels = 1.0;
constexpr int kMostListed = 1 << kItemBits;  // pixels along an edge of a picture of listed pixels

/// The film around distance 0 that a segment's surface is drawn as: half a voxel to either side,
/// and wide enough for the entries of a look's table.
Look segment_look(const Segment& segment, double opacity, const view::ResidentFrames& distance) {
  const glm::dvec3 spacing = distance.spacing_mm;
  const double entry_mm = (distance.highest - distance.lowest) / (kTable - 1);
  const double half_mm =
      std::max(0.5 * std::min({spacing.x, spacing.y, spacing.z}), 1.5 * entry_mm);
  const glm::dvec3 colour = glm::clamp(glm::dvec3(segment.colour), 0.0, 1.0);
  Look look;
  look.name = segment.name;
  look.points = {{-half_mm, colour, 0.0},
                 {-half_mm, colour, opacity},
                 {half_mm, colour, opacity},
                 {half_mm, colour, 0.0}};
  look.thickness_mm = 2.0 * half_mm;
  // A distance rises by 1 mm per mm: all of it is a surface.
  look.surface_slope = 0.5;
  return look;
}

}  // namespace

Result<std::unique_ptr<VolumeRenderer>> VolumeRenderer::make(
    std::shared_ptr<vulkan::Context> context, const RendererOptions& options) {
  if (options.most.width < 1 || options.most.height < 1 || options.most_eyes < 1 ||
      options.most_eyes > kMostEyes)
    return refused("pictures need a size, and one to four eyes");
  // Bricks are made one further than what shows: a longer segment would end beyond.
  if (!(options.samples_per_voxel >= 0.125) || !(options.near_m > 0.0))
    return refused("samples per voxel must be at least 0.125, and the nearest depth above 0");
  if (!(options.smooth >= 0.0)) return refused("what is smooth must be 0 or more");
  return tried([&] {
    return std::unique_ptr<VolumeRenderer>(new VolumeRenderer(std::move(context), options));
  });
}

VolumeRenderer::VolumeRenderer(std::shared_ptr<vulkan::Context> context,
                               const RendererOptions& options)
    : context_(std::move(context)),
      options_(options),
      kernels_(std::make_unique<view::Kernels>(context_)),
      things_(std::make_unique<view::ThingList>(context_)),
      meshes_(std::make_unique<view::MeshList>(context_)),
      light_(std::make_unique<view::LightGrid>(context_, *kernels_)),
      looks_(kMostVolumes) {
  const uint64_t pixels =
      uint64_t(options_.most.width) * uint64_t(options_.most.height) * uint64_t(options_.most_eyes);
  parameters_ = Buffer(context_, sizeof(ViewParameters), Buffer::Kind::kFilledByHost);
  const auto tables = [&](Buffer::Kind kind) {
    const uint64_t entries = uint64_t(kMostVolumes) * kTable;
    return std::make_unique<view::LookTables>(
        view::LookTables{Buffer(context_, 32 * entries, kind), Buffer(context_, 4 * entries, kind),
                         Buffer(context_, 4 * entries * kMostLevels, kind)});
  };
  tables_ = tables(Buffer::Kind::kDevice);
  staged_tables_ = tables(Buffer::Kind::kHostVisible);
  colour_texels_ = vulkan::TexelView(context_, tables_->colours, VK_FORMAT_R32G32B32A32_SFLOAT);
  thing_depth_ = Buffer(context_, 4 * pixels);
  thing_colour_ = Buffer(context_, 4 * pixels);
  colour_ = Buffer(context_, 4 * pixels);
  depth_ = Buffer(context_, 4 * pixels);
  samples_ = Buffer(context_, options_.count_samples ? 8 * pixels : 8);
  if (options_.smooth > 0.0 && std::max(options_.most.width, options_.most.height) <= kMostListed)
    lattice_ = std::make_unique<view::RayLattice>(context_, options_.most, options_.most_eyes);
  recorder_ = std::make_unique<vulkan::Recorder>(context_, 96);
}

VolumeRenderer::~VolumeRenderer() {
  // The device must be done with what is freed below, whatever became of it.
  (void)tried([&] { recorder_->wait(); });
}

Status VolumeRenderer::set_volumes(std::span<const std::shared_ptr<const MovingVolume>> volumes) {
  if (volumes.size() > kMostGiven)
    return refused("there are more than " + std::to_string(kMostGiven) + " volumes");
  for (const auto& volume : volumes) {
    if (!volume) return refused("one of its volumes is missing");
    if (const Status status = check(*volume); !status) return status.error();
  }
  return tried([&] {
    recorder_->wait();
    std::vector<std::shared_ptr<const MovingVolume>> all(volumes.begin(), volumes.end());
    std::vector<SegmentVolume> segments;
    for (const auto& volume : volumes)
      for (size_t s = 0; s < volume->segments.size() && all.size() < size_t(kMostVolumes); ++s) {
        const auto known =
            std::find_if(segments_.begin(), segments_.end(),
                         [&](const SegmentVolume& k) { return k.of == volume && k.segment == s; });
        MovingVolume distance{volume->segments[s].name,
                              volume->times,
                              volume->segments[s].distance_mm,
                              volume->motions,
                              volume->whole,
                              volume->whole_before,
                              {}};
        segments.push_back({volume, s,
                            known != segments_.end()
                                ? known->data
                                : std::make_shared<const MovingVolume>(std::move(distance))});
        all.push_back(segments.back().data);
      }
    upload(all);
    segments_ = std::move(segments);
  });
}

void VolumeRenderer::upload(std::span<const std::shared_ptr<const MovingVolume>> volumes) {
  std::vector<std::shared_ptr<const view::ResidentVolume>> residents;
  for (const auto& volume : volumes) {
    auto resident = std::make_shared<view::ResidentVolume>();
    resident->source = volume;
    const view::ResidentVolume* before = nullptr;
    for (const auto& known : residents_)
      if (known->frames->sources == volume->frames) before = known.get();
    resident->frames = before ? before->frames : view::upload_frames(context_, *kernels_, *volume);
    upload_steps(*resident, before);
    if (volume->whole)
      resident->whole = before && before->source->whole == volume->whole
                            ? before->whole
                            : view::upload_terms(context_, *resident->frames, *volume->whole);
    if (before && before->whole && volume->whole_before) {
      if (before->source->whole == volume->whole_before)
        resident->whole_before = before->whole;
      else if (before->source->whole_before == volume->whole_before)
        resident->whole_before = before->whole_before;
    }
    residents.push_back(std::move(resident));
  }
  const bool same_frames =
      std::equal(residents.begin(), residents.end(), residents_.begin(), residents_.end(),
                 [](const auto& a, const auto& b) { return a->frames == b->frames; });
  residents_ = std::move(residents);
  if (same_frames) {
    for (size_t v = 0; v < residents_.size(); ++v) shown_[v]->set_resident(residents_[v]);
    return;
  }
  shown_.clear();
  int words = 0;
  for (const auto& resident : residents_) {
    shown_.push_back(std::make_unique<view::ShownVolume>(context_, *kernels_, resident,
                                                         int(shown_.size()), words));
    words += view::ShownVolume::skip_words(*resident);
  }
  skip_ = Buffer(context_, 4 * uint64_t(std::max(words, 4)));
  skip_texels_ = vulkan::TexelView(context_, skip_, VK_FORMAT_R32_UINT);
  looks_.assign(kMostVolumes, Look{});
}

void VolumeRenderer::upload_steps(view::ResidentVolume& resident,
                                  const view::ResidentVolume* before) {
  const MovingVolume& volume = *resident.source;
  const size_t frames = volume.frames.size();
  // Without motions: one way from frame to frame all the same, on which nothing moves.
  for (size_t m = 0; m < std::max(volume.motions.size(), size_t(1)); ++m) {
    auto& steps = resident.steps.emplace_back();
    // A field's closing depends on all fields of its motion: only an equal motion is the same.
    const bool has = m < volume.motions.size(), had = before && m < before->source->motions.size();
    const bool known = before && has == had &&
                       (!has || before->source->motions[m].steps == volume.motions[m].steps) &&
                       before->source->times.cyclic() == volume.times.cyclic();
    for (size_t k = 0; k < frames; ++k) {
      if (known) {
        steps.push_back(before->steps[m][k]);
        continue;
      }
      std::shared_ptr<const view::ResidentField> field;
      if (has && k < volume.motions[m].steps.size())
        field = view::upload_field(context_, *resident.frames, volume, m, k);
      steps.push_back(view::bound_step(context_, *kernels_, *resident.frames, int(k),
                                       view::next_frame(volume, int(k)), std::move(field)));
    }
  }
}

view::ShownVolume* VolumeRenderer::shown_of(const ViewVolume& volume) {
  for (size_t v = 0; v < residents_.size(); ++v)
    if (residents_[v]->source == volume.data) return shown_[v].get();
  return nullptr;
}

/// The scene's volumes, and the segments that are to be seen as volumes of their own.
std::vector<ViewVolume> VolumeRenderer::with_segments(const ViewScene& scene) const {
  std::vector<ViewVolume> all = scene.volumes;
  for (const ViewVolume& volume : scene.volumes)
    for (size_t k = 0; k < segments_.size() && volume.segment_opacity > 0.0; ++k) {
      const SegmentVolume& segment = segments_[k];
      if (segment.of != volume.data || !volume.data->segments[segment.segment].shown) continue;
      const auto resident = std::find_if(residents_.begin(), residents_.end(),
                                         [&](const auto& r) { return r->source == segment.data; });
      ViewVolume surface = volume;
      surface.data = segment.data;
      surface.look = segment_look(volume.data->segments[segment.segment], volume.segment_opacity,
                                  *(*resident)->frames);
      all.push_back(std::move(surface));
    }
  return all;
}

Status VolumeRenderer::start(const ViewScene& scene, std::span<const Eye> eyes, PictureSize size,
                             std::shared_ptr<const VisiblePixels> visible) {
  return start(scene, eyes, size, std::move(visible), nullptr);
}

Status VolumeRenderer::start(const ViewScene& scene, std::span<const Eye> eyes, PictureSize size,
                             const HostImages& images) {
  if (const Status fine = view::check(images, int(eyes.size())); !fine) return fine;
  return start(scene, eyes, size, nullptr, &images);
}

Status VolumeRenderer::start(const ViewScene& scene, std::span<const Eye> eyes, PictureSize size,
                             std::shared_ptr<const VisiblePixels> visible,
                             const HostImages* images) {
  if (eyes.empty() || int(eyes.size()) > options_.most_eyes)
    return refused("it has no eyes, or more than the renderer was made for");
  if (size.width < 1 || size.height < 1 || size.width > options_.most.width ||
      size.height > options_.most.height)
    return refused("the picture is empty, or larger than the renderer was made for");
  if (visible && (visible->size.width != size.width || visible->size.height != size.height ||
                  visible->eyes != int(eyes.size())))
    return refused("what is said to be seen of it is about another picture");
  if (scene.volumes.empty() || scene.volumes.size() > kMostGiven)
    return refused("it has no volumes, or more than " + std::to_string(kMostGiven));
  if (!(scene.shadows >= 0.0 && scene.shadows <= 1.0))
    return refused("shadows must be from 0 to 1");
  if (scene.clips.size() > size_t(kMostPlanes))
    return refused("it has more than " + std::to_string(kMostPlanes) + " clip planes");
  if (std::any_of(scene.meshes.begin(), scene.meshes.end(),
                  [](const PlacedMesh& placed) { return !placed.mesh; }))
    return refused("one of its meshes is missing");
  for (const ViewVolume& volume : scene.volumes) {
    if (!shown_of(volume)) return refused("one of its volumes was not given to set_volumes");
    if (const Status status = check(volume.look); !status) return status.error();
    if (!(volume.segment_opacity >= 0.0 && volume.segment_opacity <= kMostSegmentOpacity))
      return refused("the opacity of its segments must be from 0 to 0.99");
  }
  return tried([&] {
    recorder_->restart();
    visible_ = std::move(visible);
    record(scene, eyes, size, images);
    recorder_->start();
  });
}

Status VolumeRenderer::prepare(const ViewScene& scene, std::span<const Eye> eyes, bool masked) {
  constexpr int kEdge = 8;  // one tile of pixels
  const PictureSize size{std::min(kEdge, options_.most.width),
                         std::min(kEdge, options_.most.height)};
  std::shared_ptr<const VisiblePixels> all;
  if (masked) {
    all = std::make_shared<const VisiblePixels>(
        VisiblePixels{size, int(eyes.size()), std::vector<uint64_t>(eyes.size(), ~uint64_t(0))});
  }
  // Seen smaller than pixels, voxels have rays of all pixels; from close by they may not.
  std::vector<Eye> close(eyes.begin(), eyes.end());
  for (Eye& eye : close)
    for (double* tangent : {&eye.tan_left, &eye.tan_right, &eye.tan_down, &eye.tan_up})
      *tangent *= 1e-4;
  for (const std::span<const Eye> these : {eyes, std::span<const Eye>(close)}) {
    if (const Status started = start(scene, these, size, all); !started) return started;
    if (const Status waited = wait(); !waited) return waited;
  }
  // A scene may have no meshes yet.
  return tried([&] {
    for (const int pass : {0, 1}) (void)kernels_->meshes(pass);
    (void)kernels_->mesh_colours();
  });
}

double VolumeRenderer::thin_per_mm(const view::ResidentVolume& resident) const {
  const glm::dvec3 spacing = resident.frames->spacing_mm;
  const double step_mm = std::min({spacing.x, spacing.y, spacing.z}) / options_.samples_per_voxel;
  return options_.skip_empty ? kThinLoss / (kStride * step_mm) : -1.0;
}

bool VolumeRenderer::set_table(int slot, const Look& look) {
  if (looks_[size_t(slot)] == look) return false;
  looks_[size_t(slot)] = look;
  const view::ResidentFrames& frames = *residents_[size_t(slot)]->frames;
  const size_t first = size_t(slot) * kTable;
  view::fill_table(
      look, frames.lowest, frames.highest,
      staged_tables_->colours.as<glm::vec4>().subspan(2 * first, 2 * kTable),
      staged_tables_->next_entries.as<uint32_t>().subspan(first, kTable),
      staged_tables_->most.as<float>().subspan(first * kMostLevels, size_t(kTable) * kMostLevels));
  return true;
}

void VolumeRenderer::upload_visible() {
  if (!visible_ || visible_ == uploaded_visible_) return;
  const uint64_t bytes = visible_->tiles.size() * sizeof(uint64_t);
  if (visible_tiles_.bytes() < bytes) {
    visible_tiles_ = Buffer(context_, bytes);
    staged_visible_ = Buffer(context_, bytes, Buffer::Kind::kHostVisible);
  }
  std::copy(visible_->tiles.begin(), visible_->tiles.end(), staged_visible_.as<uint64_t>().begin());
  recorder_->copy(staged_visible_, visible_tiles_, bytes);
  uploaded_visible_ = visible_;
}

void VolumeRenderer::record(const ViewScene& scene, std::span<const Eye> eyes, PictureSize size,
                            const HostImages* images) {
  vulkan::Recorder& recorder = *recorder_;
  size_ = size;
  eyes_ = int(eyes.size());
  recorder.stamp("start");
  const std::vector<ViewVolume> volumes = with_segments(scene);
  std::vector<bool> look_changed;
  for (const ViewVolume& volume : volumes)
    look_changed.push_back(set_table(shown_of(volume)->slot(), volume.look));
  if (std::find(look_changed.begin(), look_changed.end(), true) != look_changed.end()) {
    for (Buffer view::LookTables::*table :
         {&view::LookTables::colours, &view::LookTables::next_entries, &view::LookTables::most})
      recorder.copy((*staged_tables_).*table, (*tables_).*table, ((*tables_).*table).bytes());
  }
  ViewParameters& parameters = parameters_.as<ViewParameters>()[0];
  parameters = view::parameters_of(scene, eyes, size, options_.near_m);
  for (int e = 0; e < eyes_ && lattice_; ++e) parameters.smooth_below[e] = float(options_.smooth);
  std::vector<const view::ShownVolume*> drawn;
  bool changed = false;
  for (size_t v = 0; v < volumes.size(); ++v) {
    view::ShownVolume* shown = shown_of(volumes[v]);
    changed = shown->record(recorder, view::shown_frames_of(volumes[v], shown->resident()),
                            look_changed[v], thin_per_mm(shown->resident()),
                            options_.samples_per_voxel < kShortSteps, *tables_, skip_) ||
              changed;
    parameters.volumes[v] = view::volume_parameters_of(
        scene, volumes[v], eyes, size, *shown->resident().frames, options_.samples_per_voxel);
    parameters.volumes[v].bricks = glm::ivec4(shown->bricks(), shown->first_skip_word());
    parameters.volumes[v].table.z = float(kTable * shown->slot());
    drawn.push_back(shown);
    for (size_t e = 0; e < eyes.size(); ++e) {
      const view::SeenVoxels seen =
          view::seen_voxels(volumes[v], eyes[e], size, *shown->resident().frames);
      parameters.background_low.w = std::max(parameters.background_low.w, float(seen.farthest_m));
      if (seen.least_pixels < kLeastVoxelPixels) parameters.smooth_below[int(e)] = 0.0F;
    }
  }
  const bool lit = scene.shadows > 0.0;
  light_is_old_ = light_is_old_ || changed;
  if (lit) {
    light_->record(recorder, volumes, drawn, light_is_old_, scene, eyes, size,
                   {parameters_, colour_texels_, skip_texels_, skip_}, parameters);
    light_is_old_ = false;
  }
  upload_visible();
  recorder.stamp("volumes");
  const bool things = !scene.things.empty() || !scene.meshes.empty();
  if (things) {
    recorder.fill(thing_depth_, ~0U);
    recorder.fill(thing_colour_, 0);
    meshes_->show(scene.meshes, size, eyes_);
    things_->show(scene.things, eyes, size, options_.near_m);
    for (const int pass : {0, 1}) {
      meshes_->record(recorder, *kernels_, pass, parameters_, thing_depth_);
      things_->record(recorder, *kernels_, pass, parameters_, thing_depth_, thing_colour_);
    }
    meshes_->record_colours(recorder, *kernels_, parameters_, thing_colour_);
  }
  std::vector<vulkan::Binding> bindings{parameters_,   colour_texels_, skip_texels_, thing_depth_,
                                        thing_colour_, colour_,        depth_,       samples_};
  for (size_t v = 0; v < size_t(kMostVolumes); ++v)
    bindings.emplace_back(drawn[std::min(v, drawn.size() - 1)]->surface(), kernels_->linear());
  bindings.emplace_back(visible_ ? visible_tiles_ : samples_);
  bindings.emplace_back(skip_);
  if (images) {
    const uint64_t bytes = 8 * uint64_t(size.width) * uint64_t(size.height) * uint64_t(eyes_);
    if (backdrop_.bytes() < bytes) backdrop_ = Buffer(context_, bytes);
    parameters.backdrop = glm::vec4(images->inverse_depth_0,
                                    images->inverse_depth_1 - images->inverse_depth_0, 0.0, 0.0);
    view::record_from(*images, eyes_, size, recorder, backdrop_);
  }
  bindings.emplace_back(images ? backdrop_ : samples_);
  bindings.emplace_back(lit ? light_->light() : drawn[0]->surface(), kernels_->linear());
  bindings.emplace_back(lattice_ ? lattice_->points() : samples_);
  bindings.emplace_back(lattice_ ? lattice_->list() : samples_);
  view::RaycastChoices choices;
  choices.volumes = int(drawn.size());
  choices.things = things;
  choices.skip = options_.skip_empty;
  choices.count = options_.count_samples;
  choices.masked = visible_ != nullptr;
  choices.texels = skip_texels_.whole();
  choices.backdrop = images ? view::backdrop_bits(*images) : 0U;
  choices.lit = lit;
  choices.refines = options_.refines;
  if (parameters.smooth_below != glm::vec4(0.0F)) {
    if (options_.count_samples) recorder.fill(samples_, 0);
    lattice_->record(recorder, *kernels_, size, eyes_, choices, bindings,
                     {parameters_, thing_depth_, visible_ ? visible_tiles_ : samples_,
                      images ? backdrop_ : samples_, colour_, depth_});
  } else {
    recorder.dispatch(kernels_->raycast(choices), bindings, RaycastPush{},
                      {(size.width + 7) / 8, (size.height + 7) / 8, eyes_});
  }
  recorder.stamp("rays");
  if (images) view::record_into(*images, eyes_, size, recorder, colour_, depth_);
}

Status VolumeRenderer::wait() {
  return tried([&] { recorder_->wait(); });
}

Result<Picture> VolumeRenderer::read_back(int eye) {
  if (eye < 0 || eye >= eyes_) return refused("this eye was not drawn");
  Picture picture;
  picture.width = size_.width;
  picture.height = size_.height;
  const size_t pixels = size_t(size_.width) * size_t(size_.height), first = size_t(eye) * pixels;
  const Status status = tried([&] {
    recorder_->wait();
    const uint64_t bytes = 4 * pixels * size_t(eyes_);
    Buffer colours(context_, bytes, Buffer::Kind::kHostVisible);
    Buffer depths(context_, bytes, Buffer::Kind::kHostVisible);
    vulkan::Recorder reader(context_, 1);
    reader.copy(colour_, colours, bytes);
    reader.copy(depth_, depths, bytes);
    reader.run();
    const std::span<uint32_t> c = colours.as<uint32_t>().subspan(first, pixels);
    const std::span<float> d = depths.as<float>().subspan(first, pixels);
    picture.colours.assign(c.begin(), c.end());
    picture.depths.assign(d.begin(), d.end());
  });
  if (!status) return status.error();
  return picture;
}

ViewStatistics VolumeRenderer::statistics() {
  ViewStatistics statistics;
  statistics.light_made = light_->made();
  statistics.light_turned = light_->turned();
  const Status status = tried([&] {
    recorder_->wait();
    for (const auto& shown : shown_) statistics.frozen_nodes += shown->frozen().as<uint32_t>()[0];
    if (!options_.count_samples) return;
    const uint64_t pixels = uint64_t(size_.width) * uint64_t(size_.height) * uint64_t(eyes_);
    Buffer counts(context_, 8 * pixels, Buffer::Kind::kHostVisible);
    vulkan::Recorder reader(context_, 1);
    reader.copy(samples_, counts, counts.bytes());
    reader.run();
    const std::span<uint32_t> words = counts.as<uint32_t>();
    for (size_t i = 0; i < words.size(); i += 2) {
      statistics.samples_taken += words[i];
      statistics.samples_needed += words[i + 1];
    }
  });
  return status ? statistics : ViewStatistics{};
}

VolumeRenderer::Times VolumeRenderer::times() {
  Times times;
  const Status status = tried([&] {
    recorder_->wait();
    const auto stamps = recorder_->timestamps();
    if (stamps.size() < 3) return;
    times.update_s = stamps[1].seconds;
    times.rays_s = stamps.back().seconds - stamps[1].seconds;
  });
  return status ? times : Times{};
}

std::vector<ClipPlane> clip_box(const Transform& world_from_box, glm::dvec3 low_m,
                                glm::dvec3 high_m) {
  std::vector<ClipPlane> planes;
  for (int a = 0; a < 3; ++a) {
    glm::dvec3 axis(0.0);
    axis[a] = 1.0;
    // The faces of a scaled box stay normal to its axes.
    const glm::dvec3 normal = world_from_box.rotation * axis;
    planes.push_back({normal, glm::dot(normal, world_from_box.world_from_volume(low_m))});
    planes.push_back({-normal, -glm::dot(normal, world_from_box.world_from_volume(high_m))});
  }
  return planes;
}

}  // namespace palpate
