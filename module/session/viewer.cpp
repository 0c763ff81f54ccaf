#include "module/session/viewer.h"

#include "compute/vulkan/caught.h"
#include "module/haptics/servo/real_time.h"
#include "module/view/picture_mean.h"

namespace palpate {
namespace {

constexpr std::chrono::milliseconds kNoSnapshot{2};  // before the first snapshot

}  // namespace

Result<std::unique_ptr<Viewer>> Viewer::open(std::shared_ptr<vulkan::Context> context,
                                             const ViewChoices& choices,
                                             const RendererOptions& options) {
  auto renderer = VolumeRenderer::make(std::move(context), options);
  if (!renderer) return renderer.error();
  std::unique_ptr<Viewer> viewer(new Viewer(choices));
  viewer->renderer_ = std::move(*renderer);
  return viewer;
}

Result<std::unique_ptr<Viewer>> Viewer::open(const vulkan::ContextOptions& gpu,
                                             const ViewChoices& choices,
                                             const RendererOptions& options) {
  const auto context = vulkan::Context::open(gpu);
  return context ? open(*context, choices, options) : context.error();
}

Viewer::~Viewer() {
  if (renderer_) (void)renderer_->wait();
}

Status Viewer::update(std::shared_ptr<const Scene> scene) {
  return picture_.update(std::move(scene)) ? renderer_->set_volumes(picture_.volumes()) : Nothing{};
}

Status Viewer::update(const Session& session) {
  show(session.tubes());
  return update(session.scene());
}

Status Viewer::start(const SceneSnapshot& snapshot, int64_t display_ns, std::span<const Eye> eyes,
                     PictureSize size, const HostImages* images) {
  shown_ = picture_.at(snapshot, display_ns, eyes);
  return images ? renderer_->start(shown_, eyes, size, *images)
                : renderer_->start(shown_, eyes, size);
}

Result<std::vector<Picture>> Viewer::take_one_of(const ViewScene& scene, int n,
                                                 std::span<const Eye> eyes, PictureSize size) {
  shown_ = scene;
  const RayPlace place = ray_place(n);
  ViewScene moved = scene;
  moved.samples_moved = place.steps;
  std::vector<Eye> through;
  for (const Eye& eye : eyes) through.push_back(with_rays_at(eye, size, place.pixels));
  if (const Status started = renderer_->start(moved, through, size); !started)
    return started.error();
  std::vector<Picture> pictures;
  for (size_t eye = 0; eye < eyes.size(); ++eye) {
    auto picture = renderer_->read_back(int(eye));
    if (!picture) return picture.error();
    pictures.push_back(std::move(*picture));
  }
  return pictures;
}

Result<std::vector<Picture>> Viewer::take(const SceneSnapshot& snapshot, int64_t display_ns,
                                          std::span<const Eye> eyes, PictureSize size) {
  const ViewScene scene = scene_at(snapshot, display_ns, eyes);
  const int count = picture_.choices().averaged;
  if (count <= 1) return take_one_of(scene, 0, eyes, size);
  std::vector<PictureMean> means(eyes.size());
  for (int n = 0; n < count; ++n) {
    const auto pictures = take_one_of(scene, n, eyes, size);
    if (!pictures) return pictures.error();
    for (size_t eye = 0; eye < eyes.size(); ++eye) means[eye].add((*pictures)[eye]);
  }
  std::vector<Picture> pictures;
  for (const PictureMean& mean : means) pictures.push_back(mean.mean());
  return pictures;
}

Result<std::vector<Picture>> Viewer::take_all(const SceneSnapshot& snapshot, PictureSize size,
                                              int eyes) {
  const std::vector<glm::dvec3> corners_m = picture_.corners(snapshot);
  const SeenFrom& from = picture_.choices().from;
  std::array<Eye, 2> before = eyes_before(corners_m, size, from);
  if (eyes == 1) before[0] = eye_before(corners_m, size, from);
  return take(snapshot, snapshot.now_ns, {before.data(), size_t(eyes)}, size);
}

ViewerThread::ViewerThread(Session& session, ViewerThreadOptions options, Draw draw)
    : session_(session),
      options_(std::move(options)),
      draw_(std::move(draw)),
      thread_([this](std::stop_token stop) { run(stop); }) {}

void ViewerThread::stop() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
}

bool ViewerThread::stop_within(std::chrono::milliseconds most) {
  thread_.request_stop();
  {
    std::unique_lock lock(mutex_);
    if (!ended_.wait_for(lock, most, [this] { return has_ended_; })) return false;
  }
  stop();
  return true;
}

std::string ViewerThread::trouble() const {
  const std::lock_guard lock(mutex_);
  return trouble_;
}

void ViewerThread::run(std::stop_token stop) {
  give_way(BackgroundWork::kPictures);
  const Status drawn = caught([&] { return draw_until(stop); });
  const std::lock_guard lock(mutex_);
  if (!drawn) trouble_ = drawn.error().message;
  has_ended_ = true;
  ended_.notify_all();
}

Status ViewerThread::draw_until(std::stop_token stop) {
  const auto viewer = Viewer::open(options_.gpu, options_.choices, options_.renderer);
  if (!viewer) return viewer.error();
  SceneSnapshot snapshot;
  while (!stop.stop_requested()) {
    const auto start = std::chrono::steady_clock::now();
    const bool is_new = session_.newest(options_.reader, snapshot);
    std::chrono::milliseconds pause = kNoSnapshot;
    if (snapshot.volume_count > 0) {
      const auto drawn = draw_(**viewer, snapshot, is_new);
      if (!drawn) return drawn.error();
      pause = *drawn;
    }
    std::this_thread::sleep_until(start + pause);
  }
  return (*viewer)->renderer().wait();
}

}  // namespace palpate
