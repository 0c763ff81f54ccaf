// A running scene, ticked by the test as a host does.
#include "module/session/session.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <future>
#include <map>
#include <thread>

#include "compute/volume/phantom.h"
#include "integration/files/raster/write_volume.h"
#include "integration/loading/load_scene.h"
#include "module/session/live_slices.h"
#include "module/session/viewer.h"
#include "tests/session/made_session.h"
#include "tests/support/device.h"
#include "tests/support/wait_for.h"

namespace palpate {
namespace {

using namespace std::chrono_literals;
using EventKind = SessionEvent::Kind;

constexpr int64_t kSessionMs_ns = 1'000'000;
constexpr double kSessionStep_n =
    0.1;  // largest change of the force of a resting hand in a millisecond

/// The beating shell as frames that a program has in memory, without its motion, felt at its
/// iso-surface: on a grid this coarse it is too thin to be the usual wall.
LoadedScene shell_in_memory(int size = 40, int frames = 4) {
  auto given = std::make_shared<loading::GivenVolume>();
  given->frames = shell_phantom(size, frames, 1, 0.0);
  loading::SequenceChoices choices;
  choices.given["shell frames"] = given;
  choices.wall = loading::FeltWall::kValues;
  auto scene = loading::load_scene({"shell frames"}, choices);
  EXPECT_TRUE(scene) << (scene ? "" : scene.error().message);
  return scene ? std::move(*scene) : LoadedScene{};
}

/// A hand that a host moves, and the session's force on it.
class Hand {
 public:
  explicit Hand(Session& session) : session_(session) {}

  /// Ticks one millisecond at distance r from the middle along a slanted line.
  glm::dvec3 at(double r_m) {
    time_ns_ += kSessionMs_ns;
    const glm::dvec3 force_n =
        session_.tick({r_m * glm::normalize(glm::dvec3(0.3, 0.4, 0.9)), time_ns_});
    worst_step_n = std::max(worst_step_n, glm::length(force_n - last_n_));
    return last_n_ = force_n;
  }
  /// Moves in slowly until the force is reached. Returns the place, m; 0: there is no force.
  double press(double force_n) {
    for (double r_m = 0.07; r_m > 0.005; r_m -= 10e-6)
      if (glm::length(at(r_m)) > force_n) return r_m;
    return 0.0;
  }
  double worst_step_n = 0.0;

 private:
  Session& session_;
  int64_t time_ns_ = 5'000'000'000;
  glm::dvec3 last_n_{0.0};
};

/// The events of a session, in order.
class Events {
 public:
  std::function<void(const SessionEvent&)> listener() {
    return [this](const SessionEvent& event) {
      const std::lock_guard lock(mutex_);
      events_.push_back(event);
    };
  }
  std::vector<SessionEvent> all() const {
    const std::lock_guard lock(mutex_);
    return events_;
  }
  bool has(EventKind kind) const {
    const auto events = all();
    return std::any_of(events.begin(), events.end(),
                       [&](const SessionEvent& event) { return event.kind == kind; });
  }

 private:
  mutable std::mutex mutex_;
  std::vector<SessionEvent> events_;
};

std::unique_ptr<Session> in_host(LoadedScene scene, SessionOptions options = {}) {
  auto session = Session::start_in_host(scene, test::host_device(), std::move(options));
  EXPECT_TRUE(session) << (session ? "" : session.error().message);
  return session ? std::move(*session) : nullptr;
}

// A second hand in the same scene gets all that the first one's session gets, and is shown with it.
TEST(TwoHands, ShareMotionEventsAndTheEnd) {
  const LoadedScene scene = shell_in_memory();
  SessionOptions of_second, options;
  of_second.is_second = true;
  const auto second = in_host(scene, of_second);
  ASSERT_TRUE(second);
  options.second = second.get();
  const auto first = in_host(scene, options);
  ASSERT_TRUE(first);
  Hand hand(*first), other(*second);
  hand.at(0.05);
  other.at(0.06);
  SceneSnapshot both, of_other;
  EXPECT_TRUE(first->newest(SnapshotReader::kPictures, both));
  EXPECT_NEAR(glm::length(both.probe_m), 0.05, 1e-9);
  ASSERT_TRUE(both.has_second);
  EXPECT_NEAR(glm::length(both.second.probe_m), 0.06, 1e-9);

  // Motion that is found is felt by both.
  const auto found =
      MotionMap::of(shell_truth(shell_phantom(40, 4, 1, 0.0).frames[0].grid, 0, 1, 4));
  ASSERT_TRUE(first->take_motion(0, 0, found));
  for (const Session* session : {first.get(), second.get()})
    EXPECT_EQ(session->scene()->volumes[0].data->motions[0].steps[0], found);
  // So are events.
  EXPECT_TRUE(first->send({ControlEvent::Kind::kScrub, 0, 0.3}));
  for (int k = 0; k < 1000; ++k) {
    hand.at(0.05);
    other.at(0.06);
  }
  first->newest(SnapshotReader::kPictures, both);
  second->newest(SnapshotReader::kWindow, of_other);
  EXPECT_GT(both.volumes[0].time_s, 0.0);
  EXPECT_EQ(both.volumes[0].time_s, of_other.volumes[0].time_s);
  EXPECT_FALSE(of_other.has_second);

  first->stop();
  for (int k = 0; k < 1000; ++k) {
    hand.at(0.05);
    other.at(0.06);
  }
  EXPECT_TRUE(first->at_rest() && second->at_rest());
}

class SessionWithMotion : public test::DeviceTest {
 protected:
  SessionOptions options() {
    SessionOptions options;
    options.motion.preset = "fast";
    options.motion.open_context = [this]() -> Result<std::shared_ptr<vulkan::Context>> {
      return context();
    };
    options.on_event = events_.listener();
    return options;
  }
  Events events_;
};

TEST_F(SessionWithMotion, FindsTheMotionOfFramesInMemoryUnderTheHand) {
  auto session = in_host(shell_in_memory(), options());
  ASSERT_TRUE(session);
  EXPECT_FALSE(session->can_play());
  Hand hand(*session);
  const double r_m = hand.press(0.5);
  ASSERT_GT(r_m, 0.01);
  hand.worst_step_n = 0.0;
  // One tick of the host takes less than its millisecond: the estimation has the remaining time.
  const auto give_up = std::chrono::steady_clock::now() + 60s;
  while (!session->motion().is_done() && std::chrono::steady_clock::now() < give_up) {
    hand.at(r_m);
    std::this_thread::sleep_for(200us);
  }
  ASSERT_TRUE(session->motion().is_done());
  for (int k = 0; k < 4000; ++k) hand.at(r_m);
  EXPECT_TRUE(events_.has(EventKind::kMoves));
  EXPECT_TRUE(events_.has(EventKind::kWholeMotion));
  EXPECT_FALSE(events_.has(EventKind::kMotionFailed));
  EXPECT_TRUE(session->can_play());
  EXPECT_LT(hand.worst_step_n, kSessionStep_n);
  EXPECT_TRUE(session->scene()->volumes[0].data->whole);
  // The wall moves: at the same place the force differs with the phase.
  double least_n = 1e9, most_n = 0.0;
  for (int k = 0; k < 4000; ++k) {
    const double force_n = glm::length(hand.at(r_m));
    least_n = std::min(least_n, force_n);
    most_n = std::max(most_n, force_n);
  }
  EXPECT_GT(most_n - least_n, 0.3);
}

/// First a coarse motion, then the careful one, which is that of estimate_sequence_motion(), both
/// described from the frame that is felt; no step of it is handed over.
TEST_F(SessionWithMotion, HandsOverACoarseMotionBeforeAnyPair) {
  const LoadedScene scene = shell_in_memory();
  ASSERT_EQ(scene.missing.size(), 1U);
  const LiveMotionOptions of_motion = options().motion;
  std::vector<std::shared_ptr<const MovingVolume>> whole;
  std::vector<size_t> known;
  const LiveMotion* running = nullptr;
  std::promise<void> begin;
  LiveMotionOptions waits = of_motion;
  waits.open_context = [&, open = of_motion.open_context, begun = begin.get_future().share()]() {
    begun.wait();
    return open();
  };
  LiveMotionListener listener;
  listener.on_step = [](size_t, size_t, std::shared_ptr<const MotionMap>) -> Status {
    ADD_FAILURE() << "a step beside the coarse motion";
    return Nothing{};
  };
  listener.on_whole = [&](size_t, std::shared_ptr<const MovingVolume> volume) -> Status {
    whole.push_back(std::move(volume));
    known.push_back(running->progress().steps_known);
    return Nothing{};
  };
  listener.on_note = [](const std::string&) {};
  bool moved_early = false;
  listener.on_change = [&](const LiveMotion& motion) {
    moved_early |= motion.can_move() && motion.progress().steps_known == 0;
  };
  LiveMotion motion(scene, waits, std::move(listener));
  running = &motion;
  begin.set_value();
  motion.wait();
  ASSERT_EQ(whole.size(), 2U) << motion.trouble();
  EXPECT_EQ(known, (std::vector<size_t>{0, 4}));
  EXPECT_TRUE(moved_early);
  EXPECT_EQ(whole[0]->whole->reference(), 0U);
  EXPECT_EQ(whole[1]->whole->reference(), 0U);
  EXPECT_EQ(whole[0]->frames, whole[1]->frames);

  const auto frames = scene.missing[0].open();
  ASSERT_TRUE(frames) << frames.error().message;
  SequenceMotionOptions careful;
  careful.estimator.motion = *motion_preset("fast");
  careful.estimator.cyclic = true;
  auto alone = estimate_sequence_motion(*of_motion.open_context(), frames->grid,
                                        scene.data[0]->times.times_s, frames->read, careful);
  ASSERT_TRUE(alone) << alone.error().message;
  alone->reference = 0;
  const auto expected = SequenceMap::of(told_from_reference(*alone));
  const auto found = whole[1]->whole->coefficients(), same = expected->coefficients();
  ASSERT_EQ(found.size(), same.size());
  EXPECT_TRUE(std::equal(found.begin(), found.end(), same.begin()));
}

TEST(LoadedScene, GivesTheFramesThatWereReadWithoutReadingThemAgain) {
  const Sequence shell = shell_phantom(24, 4, 1, 0.0);
  const std::filesystem::path file =
      std::filesystem::temp_directory_path() / "palpate_read_once.seq.nrrd";
  ASSERT_TRUE(files::write_sequence(shell, file));
  const auto loaded = [&](std::optional<CarriedValues> values) {
    loading::SequenceChoices choices;
    choices.values = values;
    choices.holds_frames = true;
    choices.wall = loading::FeltWall::kValues;
    auto scene = loading::load_scene({file}, choices);
    EXPECT_TRUE(scene) << (scene ? "" : scene.error().message);
    return scene ? std::move(*scene) : LoadedScene{};
  };
  const LoadedScene carried = loaded({}), own = loaded(CarriedValues::kOwn);
  std::filesystem::remove(file);
  ASSERT_EQ(carried.missing.size(), 1u);
  ASSERT_EQ(own.missing.size(), 1u);
  {
    const auto frames = carried.missing[0].open();
    ASSERT_TRUE(frames) << frames.error().message;
    EXPECT_TRUE(frames->in_memory);
    ASSERT_EQ(frames->count, shell.frames.size());
    for (const size_t k : {3, 0, 1, 2, 1}) {
      const auto frame = frames->read(k);
      ASSERT_TRUE(frame);
      EXPECT_TRUE(same_geometry(frame->grid, shell.frames[k].grid));
      EXPECT_EQ(frame->values, shell.frames[k].values) << k;
    }
  }
  // The frames are released after this, and frames that are read only once are never kept.
  EXPECT_FALSE(carried.missing[0].open());
  EXPECT_FALSE(own.missing[0].open());
}

/// A motion that was found without times has frames one second apart; it is played as its frames
/// are.
TEST(LoadedScene, PlaysAMotionInMemoryAtThePaceOfItsFrames) {
  const auto cycle_of_scene = [](double frames_per_second, std::vector<double> times_s,
                                 std::vector<double> motion_s) {
    auto given = std::make_shared<loading::GivenVolume>();
    given->frames = shell_phantom(24, 4, 1, 0.0);
    given->frames.times_s = std::move(times_s);
    given->frames.times_known = !given->frames.times_s.empty();
    SequenceMotion& motion = given->motion.emplace();
    motion.basis = {motion_s, motion_s.back() + motion_s[1], 0};
    motion.terms.assign(4, still_field(given->frames.frames[0].grid));
    loading::SequenceChoices choices;
    choices.given["shell frames"] = given;
    choices.frames_per_second = frames_per_second;
    const auto scene = loading::load_scene({"shell frames"}, choices);
    EXPECT_TRUE(scene) << (scene ? "" : scene.error().message);
    return scene ? scene->data[0]->times : FrameTimes{};
  };
  const std::vector<double> counted = {0.0, 1.0, 2.0, 3.0}, known = {0.0, 0.2, 0.4, 0.6};
  const FrameTimes assumed = cycle_of_scene(0.0, {}, counted);
  EXPECT_TRUE(assumed.assumed);
  EXPECT_NEAR(assumed.cycle_s, 1.0, 1e-9);
  const FrameTimes asked = cycle_of_scene(2.0, {}, counted);
  EXPECT_FALSE(asked.assumed);
  EXPECT_NEAR(asked.cycle_s, 2.0, 1e-9);
  // The motion knows better than its frames, and is not changed by them.
  const FrameTimes of_motion = cycle_of_scene(0.0, {}, known);
  EXPECT_FALSE(of_motion.assumed);
  EXPECT_NEAR(of_motion.cycle_s, 0.8, 1e-9);
  EXPECT_NEAR(cycle_of_scene(0.0, known, known).cycle_s, 0.8, 1e-9);
}

TEST_F(SessionWithMotion, EndsWhileItIsBeingFound) {
  auto session = in_host(shell_in_memory(64, 6), options());
  ASSERT_TRUE(session);
  Hand hand(*session);
  hand.press(0.5);
  session.reset();
  EXPECT_FALSE(events_.has(EventKind::kMotionFailed)) << events_.all().back().sentence;
}

/// As a busy driver does, which ends a call when it has done what it was given.
TEST_F(SessionWithMotion, StopsTheForceBeforeItWaitsForTheEstimation) {
  std::promise<void> released;
  std::atomic<bool> asked{false};
  SessionOptions busy = options();
  busy.motion.open_context =
      [&, wait = released.get_future().share()]() -> Result<std::shared_ptr<vulkan::Context>> {
    asked = true;
    wait.wait();
    return context();
  };
  auto session = in_host(shell_in_memory(), busy);
  ASSERT_TRUE(session);
  Hand hand(*session);
  const double r_m = hand.press(0.5);
  ASSERT_GT(r_m, 0.01);
  while (!asked) std::this_thread::sleep_for(1ms);
  auto stopped = std::async(std::launch::async, [&] { session->stop(); });
  for (int k = 0; k < 60000 && !session->at_rest(); ++k) {
    hand.at(r_m);
    std::this_thread::sleep_for(1ms);
  }
  EXPECT_TRUE(session->at_rest());
  EXPECT_EQ(stopped.wait_for(0s), std::future_status::timeout);
  released.set_value();
  stopped.get();
}

TEST_F(SessionWithMotion, AViewerIsNotWaitedForLongerThanAsked) {
  auto session = in_host(shell_in_memory(24));
  ASSERT_TRUE(session);
  Hand(*session).at(0.1);
  std::promise<void> released;
  std::atomic<bool> draws{false};
  ViewerThread viewer(
      *session, {.renderer = {.most = {64, 64}}},
      [&, wait = released.get_future().share()](Viewer&, const SceneSnapshot&,
                                                bool) -> Result<std::chrono::milliseconds> {
        draws = true;
        wait.wait();
        return 1ms;
      });
  for (int k = 0; k < 60000 && !draws; ++k) std::this_thread::sleep_for(1ms);
  ASSERT_TRUE(draws) << viewer.trouble();
  EXPECT_FALSE(viewer.stop_within(5ms));
  released.set_value();
  EXPECT_TRUE(viewer.stop_within(60s));
  EXPECT_EQ(viewer.trouble(), "");
}

TEST_F(SessionWithMotion, SaysWhyThereIsNone) {
  SessionOptions failing = options();
  failing.motion.open_context = []() -> Result<std::shared_ptr<vulkan::Context>> {
    return Error{ErrorKind::kNoDevice, "There is no device today"};
  };
  auto session = in_host(shell_in_memory(), failing);
  ASSERT_TRUE(session);
  while (!session->motion().is_done()) std::this_thread::sleep_for(1ms);
  Hand hand(*session);
  EXPECT_GT(hand.press(0.5), 0.01) << "the data that are there are not felt";
  for (int k = 0; k < 1000 && !events_.has(EventKind::kMotionFailed); ++k)
    std::this_thread::sleep_for(1ms);
  ASSERT_TRUE(events_.has(EventKind::kMotionFailed));
  EXPECT_NE(events_.all().back().sentence.find("There is no device today"), std::string::npos);
}

TEST_F(SessionWithMotion, SaysWhatWasThrownOnTheEstimationsThread) {
  SessionOptions throwing = options();
  throwing.motion.open_context = []() -> Result<std::shared_ptr<vulkan::Context>> {
    throw std::runtime_error("the driver has fallen over");
  };
  auto session = in_host(shell_in_memory(), throwing);
  ASSERT_TRUE(session);
  for (int k = 0; k < 10000 && !events_.has(EventKind::kMotionFailed); ++k)
    std::this_thread::sleep_for(1ms);
  ASSERT_TRUE(events_.has(EventKind::kMotionFailed));
  EXPECT_NE(events_.all().back().sentence.find("the driver has fallen over"), std::string::npos);
  Hand hand(*session);
  EXPECT_GT(hand.press(0.5), 0.01) << "the data that are there are not felt";
}

TEST_F(SessionWithMotion, GoesOnWhereItsListenersThrow) {
  SessionOptions throwing = options();
  std::atomic<int> told{0}, asked{0};
  throwing.on_event = [&](const SessionEvent&) {
    ++told;
    throw std::runtime_error("nobody listens");
  };
  throwing.next_note = [&]() -> std::string {
    ++asked;
    throw 17;
  };
  auto session = in_host(shell_in_memory(), throwing);
  ASSERT_TRUE(session);
  // There is no motion yet, which is an event.
  session->release_tube();
  Hand hand(*session);
  const double r_m = hand.press(0.5);
  EXPECT_GT(r_m, 0.01);
  for (int k = 0; k < 60000 && !session->motion().is_done(); ++k) {
    hand.at(r_m);
    std::this_thread::sleep_for(1ms);
  }
  EXPECT_TRUE(session->motion().is_done());
  EXPECT_EQ(session->motion().trouble(), "");
  EXPECT_TRUE(session->can_play());
  EXPECT_GT(told, 1);
  EXPECT_GT(asked, 1);
}

TEST_F(SessionWithMotion, AnEstimatorSaysWhatItsListenerThrew) {
  const Sequence frames = shell_phantom(24, 3, 1, 0.0);
  EstimatorOptions fast;
  fast.motion = *motion_preset("fast");
  auto estimator = SequenceEstimator::open(context(), frames.frames[0].grid, fast, [](PairMotion) {
    throw std::runtime_error("the list is full");
  });
  ASSERT_TRUE(estimator) << estimator.error().message;
  for (size_t k = 0; k < frames.frames.size(); ++k)
    if (!(*estimator)->push(k, frames.frames[k])) break;
  const Status done = (*estimator)->finish();
  ASSERT_FALSE(done);
  EXPECT_NE(done.error().message.find("the list is full"), std::string::npos)
      << done.error().message;
}

TEST(Session, WithoutADeviceToComputeStandsStill) {
  auto session = in_host(shell_in_memory());
  ASSERT_TRUE(session);
  EXPECT_TRUE(session->motion().is_done());
  EXPECT_FALSE(session->can_play());
  Hand hand(*session);
  const double r_m = hand.press(0.5);
  ASSERT_GT(r_m, 0.01);
  for (int k = 0; k < 2000; ++k) hand.at(r_m);
  const double before_n = glm::length(hand.at(r_m));
  for (int k = 0; k < 1000; ++k) EXPECT_NEAR(glm::length(hand.at(r_m)), before_n, 0.05);
}

TEST(Session, PlacesAVolumeThatMayBeMoved) {
  LoadedScene scene = shell_in_memory();
  ASSERT_FALSE(scene.spec.volumes.empty());
  scene.spec.volumes[0].drive.kind = DriveSpec::Kind::kSecondHand;
  scene.spec.volumes[0].path = usual_path(DriveSpec::Kind::kSecondHand);
  const Transform start = scene.spec.volumes[0].transform;
  auto session = in_host(scene);
  ASSERT_TRUE(session);
  Hand hand(*session);
  const double r_m = hand.press(0.5);
  Transform away = start;
  away.translation_m += glm::dvec3(0.0, 0.0, -0.05);
  hand.worst_step_n = 0.0;
  for (int k = 0; k < 1000; ++k) {
    // Poses have monotonic times, which the smooth path follows.
    if (k % 16 == 0) {
      Transform part = start;
      part.translation_m += std::min(1.0, k / 500.0) * (away.translation_m - start.translation_m);
      EXPECT_TRUE(session->place(0, part));
    }
    hand.at(r_m);
    std::this_thread::sleep_for(1ms);
  }
  EXPECT_EQ(glm::length(hand.at(r_m)), 0.0);
  EXPECT_FALSE(session->place(7, away));
  SceneSnapshot snapshot;
  session->newest(SnapshotReader::kPictures, snapshot);
  EXPECT_NEAR(snapshot.volumes[0].world_from_volume.translation_m.z, away.translation_m.z, 1e-4);
}

TEST(Session, PlaysPausesAndScrubs) {
  auto scene = loading::load_scene({"shell"}, {});
  ASSERT_TRUE(scene);
  auto session = in_host(std::move(*scene));
  ASSERT_TRUE(session);
  EXPECT_TRUE(session->can_play());
  Hand hand(*session);
  const auto time_after = [&](int ticks) {
    for (int k = 0; k < ticks; ++k) hand.at(0.1);
    SceneSnapshot snapshot;
    session->newest(SnapshotReader::kPictures, snapshot);
    return snapshot;
  };
  const double first_s = time_after(100).volumes[0].time_s;
  EXPECT_NE(time_after(100).volumes[0].time_s, first_s);
  session->toggle_play();
  // It comes to rest by a ramp.
  time_after(1000);
  const SceneSnapshot paused = time_after(1);
  EXPECT_EQ(time_after(100).volumes[0].time_s, paused.volumes[0].time_s);
  session->scrub(paused, 0.25);
  const SceneSnapshot scrubbed = time_after(500);
  const double length_s = session->scene()->volumes[0].data->times.length_s();
  double moved_s = scrubbed.volumes[0].time_s - paused.volumes[0].time_s;
  if (moved_s < 0.0) moved_s += length_s;
  EXPECT_NEAR(moved_s, 0.25 * length_s, 1e-9);
  session->toggle_play();
  EXPECT_NE(time_after(200).volumes[0].time_s, scrubbed.volumes[0].time_s);
  // A step after a jump starts where the jump led, not where an older picture shows the volume.
  session->scrub_to(0.5);
  session->scrub(paused, 0.1);
  EXPECT_NEAR(time_after(500).volumes[0].time_s, 0.6 * length_s, 1e-9);
}

TEST(Session, ThatIsStoppedInItsHostRampsWhileTheHostTicks) {
  auto session = in_host(shell_in_memory());
  ASSERT_TRUE(session);
  Hand hand(*session);
  const double r_m = hand.press(0.5);
  for (int k = 0; k < 1000; ++k) hand.at(r_m);
  hand.worst_step_n = 0.0;
  session->stop();
  EXPECT_FALSE(session->at_rest());
  for (int k = 0; k < 600; ++k) hand.at(r_m);
  EXPECT_TRUE(session->at_rest());
  EXPECT_EQ(hand.at(r_m), glm::dvec3(0.0));
  EXPECT_LT(hand.worst_step_n, kSessionStep_n);
}

TEST(Session, TwoAtOnceDoNotKnowEachOther) {
  auto first = in_host(shell_in_memory()), second = in_host(shell_in_memory());
  ASSERT_TRUE(first && second);
  Hand left(*first), right(*second);
  EXPECT_EQ(left.press(0.5), right.press(0.5));
  first.reset();
  EXPECT_GT(glm::length(right.at(0.02)), 0.0);
}

TEST(SlicesOfASession, ShowWhatIsFeltWhereItIsTouched) {
  auto session = in_host(shell_in_memory());
  ASSERT_TRUE(session);
  Hand hand(*session);
  hand.at(0.05);
  SceneSnapshot snapshot;
  ASSERT_TRUE(session->newest(SnapshotReader::kPictures, snapshot));
  ScenePicture picture(ViewChoices{});
  picture.update(session->scene());
  const auto felt = picture.slices(snapshot, 40);
  ASSERT_TRUE(felt);
  ASSERT_EQ(felt->walls.size(), 1U);
  EXPECT_GT(felt->planes[0].contours_px[0].size(), 20U);
  // The first picture is axial: x is L, y is P, and the middle of the data is in its middle.
  const Slice& axial = felt->planes[0];
  const glm::dvec2 from_middle = axial.place_px - 0.5 * glm::dvec2(axial.width, axial.height);
  EXPECT_NEAR(felt->px_mm * from_middle.x, 1e3 * snapshot.proxy_m.x, 1e-6);
  EXPECT_NEAR(felt->px_mm * from_middle.y, -1e3 * snapshot.proxy_m.z, 1e-6);

  // Without a hand nothing is felt, and they go through the middle.
  ViewChoices seen;
  seen.hand = false;
  picture.choose(seen);
  const auto middle = picture.slices(snapshot, 40);
  ASSERT_TRUE(middle);
  EXPECT_TRUE(middle->walls.empty());
  EXPECT_NEAR(middle->planes[0].place_px.x, 0.5 * middle->planes[0].width, 1e-9);
}

TEST(SlicesOfASession, AreSampledAgainOnlyWhereSomethingHasChanged) {
  auto session = in_host(shell_in_memory());
  ASSERT_TRUE(session);
  Hand hand(*session);
  hand.at(0.05);
  WantedSlices wanted{{}, {}, 40};
  ASSERT_TRUE(session->newest(SnapshotReader::kPictures, wanted.snapshot));
  LiveSlices slices(*session);
  slices.want(wanted);
  ASSERT_TRUE(wait_for([&] { return slices.newest() != nullptr; }));
  const auto first = slices.newest();
  for (int k = 0; k < 4; ++k) {
    slices.want(wanted);
    std::this_thread::sleep_for(std::chrono::milliseconds(150));
    EXPECT_EQ(slices.newest(), first);
  }
  wanted.snapshot.proxy_m.y += 0.01;
  slices.want(wanted);
  EXPECT_TRUE(wait_for([&] { return slices.newest() != first; }));
}

TEST(Session, RefusesASceneThatCanNotBePutTogether) {
  LoadedScene scene = shell_in_memory();
  ASSERT_FALSE(scene.spec.modes.empty());
  scene.spec.modes[0].volume = "nowhere";
  const auto session = Session::start_in_host(scene, test::host_device(), {});
  ASSERT_FALSE(session);
  EXPECT_EQ(session.error().kind, ErrorKind::kBadInput);
}

}  // namespace
}  // namespace palpate
