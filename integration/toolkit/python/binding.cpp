// palpate._palpate: the C library for Python. Arrays in and out, the interpreter's lock released
// while palpate works; the interface for people is palpate/__init__.py.
#include <pybind11/functional.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <array>
#include <atomic>
#include <chrono>
#include <deque>
#include <exception>
#include <future>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "integration/toolkit/palpate_adapter.h"

namespace py = pybind11;

namespace {

using palpate::adapter::UniqueHandle;

/// Raises the exception for a failure, with the library's sentence.
void check(PalResult result, const std::string& sentence) {
  if (result >= PAL_OK) return;
  switch (result) {
    case PAL_BAD_INPUT:
      throw py::value_error(sentence);
    case PAL_BAD_OUTPUT:
      PyErr_SetString(PyExc_OSError, sentence.c_str());
      throw py::error_already_set();
    case PAL_OUT_OF_MEMORY:
      PyErr_SetString(PyExc_MemoryError, sentence.c_str());
      throw py::error_already_set();
    case PAL_CANCELLED:
      PyErr_SetString(PyExc_InterruptedError, sentence.c_str());
      throw py::error_already_set();
    default:
      throw std::runtime_error(sentence);
  }
}

void check(PalResult result) {
  check(result, pal_last_error());
}

/// Runs long work without the interpreter's lock.
template <class Work>
void without_lock(const Work& work) {
  PalResult result;
  {
    const py::gil_scoped_release released;
    result = work();
  }
  check(result);
}

PalSampleType type_of(const py::array& array) {
  const py::dtype type = array.dtype();
  // By value: arrays read from files have type objects of their own.
  const auto is = [&](const char* name) { return type.equal(py::dtype(name)); };
  if (is("float32")) return PAL_FLOAT32;
  if (is("float64")) return PAL_FLOAT64;
  if (is("int8")) return PAL_INT8;
  if (is("uint8")) return PAL_UINT8;
  if (is("int16")) return PAL_INT16;
  if (is("uint16")) return PAL_UINT16;
  if (is("int32")) return PAL_INT32;
  if (is("uint32")) return PAL_UINT32;
  throw py::type_error("samples of this type can not be taken: convert them to float32");
}

/// Samples of shape (z, y, x), contiguous, without a copy.
const void* samples_of(const py::array& array, const PalGrid& grid) {
  if (array.ndim() != 3 || array.shape(0) != py::ssize_t(grid.size[2]) ||
      array.shape(1) != py::ssize_t(grid.size[1]) || array.shape(2) != py::ssize_t(grid.size[0]))
    throw py::value_error("a frame has another shape than the first one");
  if (!(array.flags() & py::array::c_style))
    throw py::value_error("a frame is not contiguous in memory");
  return array.data();
}

PalGrid grid_of(const std::array<uint32_t, 3>& size, const std::array<double, 3>& spacing,
                const std::array<double, 3>& origin, const std::array<double, 9>& direction) {
  PalGrid grid{};
  for (size_t a = 0; a < 3; ++a) {
    grid.size[a] = size[a];
    grid.spacing_mm[a] = spacing[a];
    grid.origin_mm[a] = origin[a];
  }
  std::copy(direction.begin(), direction.end(), grid.direction);
  return grid;
}

/// given: size, spacing, origin, direction.
PalGrid grid_of(const py::tuple& given) {
  return grid_of(given[0].cast<std::array<uint32_t, 3>>(), given[1].cast<std::array<double, 3>>(),
                 given[2].cast<std::array<double, 3>>(), given[3].cast<std::array<double, 9>>());
}

py::array_t<float> volume_for(const PalGrid& grid) {
  return py::array_t<float>(
      {py::ssize_t(grid.size[2]), py::ssize_t(grid.size[1]), py::ssize_t(grid.size[0])});
}

/// Spacing, origin and direction.
py::tuple geometry_of(const PalGrid& grid) {
  const auto list = [](const double* from, size_t count) {
    return std::vector<double>(from, from + count);
  };
  return py::make_tuple(list(grid.spacing_mm, 3), list(grid.origin_mm, 3), list(grid.direction, 9));
}

/// (z, y, x)
py::tuple shape_of(const PalGrid& grid) {
  return py::make_tuple(grid.size[2], grid.size[1], grid.size[0]);
}

/// Whether a change was accepted: false for PAL_NOT_YET.
bool was_taken(PalResult result) {
  check(result);
  return result == PAL_OK;
}

/// Frames from files.
class PythonSequence {
 public:
  PythonSequence(const std::vector<std::string>& paths, std::optional<double> nan_as) {
    std::vector<const char*> names;
    for (const std::string& path : paths) names.push_back(path.c_str());
    PalSequenceInfo info{};
    info.size = sizeof info;
    info.paths = names.data();
    info.path_count = uint32_t(names.size());
    info.nan_as = nan_as ? &*nan_as : nullptr;
    without_lock([&] { return pal_sequence_open(&info, &handle_.handle); });
    summary_.size = sizeof summary_;
    check(pal_sequence_summary(handle_.handle, &summary_));
  }
  uint32_t count() const { return summary_.frame_count; }
  py::tuple geometry() const { return geometry_of(summary_.grid); }
  py::tuple size() const { return shape_of(summary_.grid); }
  bool has_times() const { return summary_.has_times != 0; }
  std::string notes() const { return summary_.notes; }
  double time_s(uint32_t index) const {
    double time = 0.0;
    check(pal_sequence_frame(handle_.handle, index, nullptr, &time));
    return time;
  }
  py::array_t<float> frame(uint32_t index) const {
    py::array_t<float> values = volume_for(summary_.grid);
    float* const to = values.mutable_data();
    without_lock([&] { return pal_sequence_frame(handle_.handle, index, to, nullptr); });
    return values;
  }

 private:
  UniqueHandle<PalSequence, pal_sequence_close> handle_;
  PalSequenceSummary summary_{};
};

class PythonContext {
 public:
  explicit PythonContext(const std::optional<std::string>& device, bool computes) {
    PalContextInfo info{};
    info.size = sizeof info;
    info.version = PAL_VERSION;
    info.flags = computes ? 0 : uint32_t(PAL_CONTEXT_NO_GPU);
    if (device) info.device = device->c_str();
    without_lock([&] { return pal_context_open(&info, &handle); });
  }
  ~PythonContext() { pal_context_close(&handle); }
  PythonContext(const PythonContext&) = delete;
  PythonContext& operator=(const PythonContext&) = delete;
  std::string device() const { return pal_context_device(handle); }

  /// Passes on a result; records a failure of the device.
  PalResult told(PalResult result) const {
    if (result == PAL_DEVICE_FAILED) failed = true;
    return result;
  }

  PalContext* handle = nullptr;
  /// The device was lost, or work on it failed: the next work opens another one. Any thread.
  mutable std::atomic<bool> failed{false};
};

/// An estimated motion.
class PythonMotion {
 public:
  explicit PythonMotion(PalMotion* found) {
    handle_.handle = found;
    summary_.size = sizeof summary_;
    check(pal_motion_summary(found, &summary_));
  }

  py::array_t<float> field(uint32_t step, std::optional<double> time_s, bool inverse) const {
    const PalFieldInfo info = wanted(step, time_s, inverse);
    const PalGrid& grid = summary_.grid;
    py::array_t<float> u({py::ssize_t(grid.size[2]), py::ssize_t(grid.size[1]),
                          py::ssize_t(grid.size[0]), py::ssize_t(3)});
    float* const to = u.mutable_data();
    without_lock([&] { return pal_motion_field(handle_.handle, &info, to); });
    return u;
  }
  py::array_t<float> confidence(uint32_t step) const {
    const PalFieldInfo info = wanted(step, std::nullopt, false);
    py::array_t<float> values = volume_for(summary_.grid);
    float* const to = values.mutable_data();
    without_lock([&] { return pal_motion_confidence(handle_.handle, &info, to); });
    return values;
  }
  py::array_t<float> deviation(uint32_t step) const {
    const PalFieldInfo info = wanted(step, std::nullopt, false);
    const PalGrid& grid = summary_.grid;
    py::array_t<float> sd({py::ssize_t(grid.size[2]), py::ssize_t(grid.size[1]),
                           py::ssize_t(grid.size[0]), py::ssize_t(2)});
    float* const to = sd.mutable_data();
    without_lock([&] { return pal_motion_deviation(handle_.handle, &info, to); });
    return sd;
  }
  py::array_t<float> warp(const py::array& frame, uint32_t step, std::optional<double> time_s,
                          bool inverse) const {
    const PalFieldInfo info = wanted(step, time_s, inverse);
    const PalSampleType type = type_of(frame);
    const void* const samples = samples_of(frame, summary_.grid);
    py::array_t<float> warped = volume_for(summary_.grid);
    float* const to = warped.mutable_data();
    without_lock([&] { return pal_motion_warp(handle_.handle, &info, type, samples, to); });
    return warped;
  }
  void save(const std::string& path, std::optional<uint32_t> step) const {
    const PalFieldInfo info = wanted(step.value_or(0), std::nullopt, false);
    without_lock(
        [&] { return pal_motion_save(handle_.handle, step ? &info : nullptr, path.c_str()); });
  }
  /// Spacing, origin and direction of the frames.
  py::tuple geometry() const { return geometry_of(summary_.grid); }
  /// The shape of the frames, (z, y, x).
  py::tuple size() const { return shape_of(summary_.grid); }
  py::dict summary() const {
    const PalMotionSummary& s = summary_;
    using namespace py::literals;
    return py::dict(
        "frame_count"_a = s.frame_count, "step_count"_a = s.step_count,
        "is_whole"_a = s.is_whole != 0, "reference_frame"_a = s.reference_frame,
        "harmonics"_a = s.harmonics, "cycle_s"_a = s.cycle_s, "trust"_a = std::string(s.trust_word),
        "reasons"_a = std::string(s.reasons), "seconds"_a = s.seconds,
        "motion_mean_mm"_a = s.motion_mean_mm, "motion_max_mm"_a = s.motion_max_mm,
        "folded_voxels"_a = s.folded_voxels, "least_determinant"_a = s.least_determinant,
        "correlation_before"_a = s.correlation_before, "correlation_after"_a = s.correlation_after,
        "motion_left_voxels"_a = s.motion_left_voxels, "drift_mean_mm"_a = s.drift_mean_mm,
        "within_95_mm"_a = s.within_95_mm);
  }

 private:
  static PalFieldInfo wanted(uint32_t step, std::optional<double> time_s, bool inverse) {
    PalFieldInfo info{};
    info.size = sizeof info;
    info.step = step;
    info.time_s = time_s.value_or(0.0);
    info.flags =
        (time_s ? uint32_t(PAL_FIELD_TO_TIME) : 0U) | (inverse ? uint32_t(PAL_FIELD_INVERSE) : 0U);
    return info;
  }
  UniqueHandle<PalMotion, pal_motion_close> handle_;
  PalMotionSummary summary_{};
};

/// Python's callbacks while an estimator works.
struct Listener {
  py::function progress;
  PalEstimator* estimator = nullptr;
  std::exception_ptr raised;

  static void hear(void* user, const char* doing, double share) {
    auto* const self = static_cast<Listener*>(user);
    const py::gil_scoped_acquire acquired;
    if (self->raised) return;
    try {
      self->progress(std::string(doing), share);
    } catch (...) {
      self->raised = std::current_exception();
      pal_estimator_cancel(self->estimator);
    }
  }
};

/// Gives the estimator all frames. Throws what Python raised meanwhile.
void push_all(const PythonContext& context, PalEstimator* estimator, const PalGrid& grid,
              const std::vector<py::array>& frames, const std::vector<double>& times_s,
              const Listener& listener) {
  for (size_t k = 0; k < frames.size(); ++k) {
    const PalSampleType type = type_of(frames[k]);
    const void* const samples = samples_of(frames[k], grid);
    const double time_s = times_s.empty() ? -1.0 : times_s[k];
    PalResult pushed;
    {
      const py::gil_scoped_release released;
      pushed = context.told(pal_estimator_push(estimator, type, samples, time_s));
    }
    // push() may have waited for a pair; if it was cancelled meanwhile, report why.
    const std::string sentence = pal_last_error();
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    if (listener.raised) std::rethrow_exception(listener.raised);
    check(pushed, sentence);
  }
}

/// Waits for the end, and cancels at Ctrl-C. Whether it was cancelled.
bool wait_for_end(const std::future<PalResult>& finished, PalEstimator* estimator) {
  bool interrupted = false;
  while (true) {
    std::future_status status;
    {
      const py::gil_scoped_release released;
      status = finished.wait_for(std::chrono::milliseconds(50));
    }
    if (status == std::future_status::ready) return interrupted;
    if (!interrupted && PyErr_CheckSignals() != 0) {
      interrupted = true;
      pal_estimator_cancel(estimator);
    }
  }
}

/// Estimates the motion of frames (shape (z, y, x), contiguous, without a copy).
std::unique_ptr<PythonMotion> estimate(
    const PythonContext& context, const std::vector<py::array>& frames,
    const std::array<uint32_t, 3>& size, const std::array<double, 3>& spacing,
    const std::array<double, 3>& origin, const std::array<double, 9>& direction,
    const std::string& preset, const std::vector<double>& times_s,
    const std::optional<py::array_t<uint8_t, py::array::c_style>>& mask, uint32_t flags,
    const std::optional<py::function>& progress) {
  PalEstimatorInfo info{};
  info.size = sizeof info;
  info.flags = flags;
  info.grid = grid_of(size, spacing, origin, direction);
  info.preset = preset.c_str();
  if (mask) info.mask = static_cast<const uint8_t*>(samples_of(*mask, info.grid));
  Listener listener;
  if (progress) {
    listener.progress = *progress;
    info.on_progress = &Listener::hear;
    info.user = &listener;
  }
  struct Owner {
    PalEstimator* handle = nullptr;
    ~Owner() {
      const py::gil_scoped_release released;
      pal_estimator_close(&handle);
    }
  } owner;
  without_lock(
      [&] { return context.told(pal_estimator_open(context.handle, &info, &owner.handle)); });
  listener.estimator = owner.handle;
  push_all(context, owner.handle, info.grid, frames, times_s, listener);
  // On a thread of its own, so that Ctrl-C is handled here.
  PalMotion* found = nullptr;
  std::string sentence;
  auto finished = std::async(std::launch::async, [&] {
    const PalResult result = pal_estimator_finish(owner.handle, &found);
    if (result < PAL_OK) sentence = pal_last_error();
    return result;
  });
  const bool interrupted = wait_for_end(finished, owner.handle);
  const PalResult result = context.told(finished.get());
  std::unique_ptr<PythonMotion> motion = found ? std::make_unique<PythonMotion>(found) : nullptr;
  if (interrupted) throw py::error_already_set();
  if (listener.raised) std::rethrow_exception(listener.raised);
  check(result, sentence);
  return motion;
}

std::unique_ptr<PythonMotion> opened_motion(const PythonContext& context, const std::string& path) {
  PalMotion* found = nullptr;
  without_lock([&] { return context.told(pal_motion_open(context.handle, path.c_str(), &found)); });
  return std::make_unique<PythonMotion>(found);
}

/// Python's named arguments as fields of the structures in palpate.h: None becomes 0.
class Words {
 public:
  explicit Words(const py::dict& given) : given_(given) {}
  const char* text(const char* name) {
    const py::object value = of(name);
    if (value.is_none()) return nullptr;
    return kept_.emplace_back(value.cast<std::string>()).c_str();
  }
  double number(const char* name) const {
    const py::object value = of(name);
    return value.is_none() ? 0.0 : value.cast<double>();
  }
  uint32_t count(const char* name) const { return of(name).cast<uint32_t>(); }
  /// Valid during the lifetime of this object.
  const std::vector<const char*>& list(const char* name) {
    auto& list = lists_.emplace_back();
    for (const py::handle item : of(name))
      list.push_back(kept_.emplace_back(item.cast<std::string>()).c_str());
    return list;
  }
  py::object of(const char* name) const { return given_[name]; }

 private:
  py::dict given_;
  std::deque<std::string> kept_;
  std::deque<std::vector<const char*>> lists_;
};

/// Frames in memory used instead of files, read without a copy while a scene is opened.
struct FramesInMemory {
  /// frames: None, or a list of arrays; grid: size, spacing, origin, direction.
  FramesInMemory(const Words& words, const char* name) {
    const py::object given = words.of("frames");
    info.size = sizeof info;
    if (given.is_none()) return;
    info.name = name;
    info.grid = grid_of(words.of("grid").cast<py::tuple>());
    for (const py::handle frame : given) {
      arrays.push_back(frame.cast<py::array>());
      if (!arrays.back().dtype().equal(arrays.front().dtype()))
        throw py::type_error("the frames have samples of different types: convert them to one");
      samples.push_back(samples_of(arrays.back(), info.grid));
    }
    times_s = words.of("times").cast<std::vector<double>>();
    info.sample_type = type_of(arrays.front());
    info.frames = samples.data();
    info.frame_count = uint32_t(samples.size());
    if (!times_s.empty()) info.times_s = times_s.data();
  }
  std::vector<py::array> arrays;
  std::vector<const void*> samples;
  std::vector<double> times_s;
  PalFrames info{};
};

/// The table of options, as JSON.
std::string options() {
  size_t length = 0;
  pal_options(nullptr, 0, &length);
  std::string text(length, '\0');
  pal_options(text.data(), length + 1, nullptr);
  return text;
}

/// A running scene, in Python's own loop or in palpate's, and its pictures.
class PythonSession {
 public:
  PythonSession(std::shared_ptr<PythonContext> context, const py::dict& of_scene,
                const py::dict& of_session)
      : context_(std::move(context)) {
    open_scene(Words(of_scene));
    open_session(Words(of_session));
  }
  ~PythonSession() {
    const py::gil_scoped_release released;
    end();
  }
  PythonSession(const PythonSession&) = delete;
  PythonSession& operator=(const PythonSession&) = delete;

  void close() {
    without_lock([&] { return end(); });
  }

  std::array<double, 3> tick(const std::array<double, 3>& position_m, int64_t time_ns,
                             uint32_t buttons) {
    const PalTick tick{{position_m[0], position_m[1], position_m[2]}, time_ns, buttons};
    std::array<double, 3> force_n{};
    check(pal_haptics_tick(session_.handle, &tick, force_n.data()));
    return force_n;
  }
  std::array<double, 3> torque() {
    std::array<double, 3> torque_n_m{};
    check(pal_haptics_torque(session_.handle, torque_n_m.data()));
    return torque_n_m;
  }
  /// rotation: w, x, y, z; None: not sensed, as the opening.
  void hold(const std::optional<std::array<double, 4>>& rotation,
            const std::array<double, 3>& angular_velocity_rad_per_s,
            const std::optional<double>& opening_rad) {
    PalGrip grip{};
    grip.size = sizeof grip;
    if (rotation) {
      grip.senses |= PAL_GRIP_TURNS;
      std::copy(rotation->begin(), rotation->end(), grip.device_from_grip);
      std::copy(angular_velocity_rad_per_s.begin(), angular_velocity_rad_per_s.end(),
                grip.angular_velocity_rad_per_s);
    }
    if (opening_rad) {
      grip.senses |= PAL_GRIP_OPENS;
      grip.opening_rad = *opening_rad;
    }
    check(pal_haptics_hold(session_.handle, &grip));
  }
  void stop() {
    without_lock([&] { return pal_session_stop(session_.handle); });
  }
  bool at_rest() const { return pal_session_at_rest(session_.handle) != 0; }
  bool play(bool on) { return was_taken(pal_session_play(session_.handle, on)); }
  bool scrub(double share) { return was_taken(pal_session_scrub(session_.handle, share)); }
  bool rearm() { return was_taken(pal_session_rearm(session_.handle)); }
  bool place(uint32_t volume, const std::array<double, 12>& world_from_volume) {
    return was_taken(pal_session_place(session_.handle, volume, world_from_volume.data()));
  }
  bool set_mode(uint32_t index, bool on, double gain) {
    return was_taken(pal_session_set_mode(session_.handle, index, on, gain));
  }
  /// grid: size, spacing, origin, direction; None: that of the first frame.
  void push_frame(const py::array& frame, const std::optional<py::tuple>& grid, int64_t time_ns) {
    // Without frames in memory the library reports that it takes none.
    const bool takes_none = !grid && first_grid_.size[0] == 0;
    PalGrid where = first_grid_;
    if (grid) where = grid_of(*grid);
    const PalSampleType type = type_of(frame);
    const void* const samples = takes_none ? frame.data() : samples_of(frame, where);
    without_lock([&] {
      return pal_session_push_frame(session_.handle, takes_none ? nullptr : &where, type, samples,
                                    time_ns);
    });
  }
  py::dict replay(const std::string& recording, const std::optional<std::string>& tubes) const {
    PalReplay found{};
    found.size = sizeof found;
    without_lock([&] {
      return pal_scene_replay(scene_.handle, recording.c_str(), tubes ? tubes->c_str() : nullptr,
                              &found);
    });
    using namespace py::literals;
    const py::object first = found.first_different < 0
                                 ? py::object(py::none())
                                 : py::object(py::int_(found.first_different));
    return py::dict("ticks"_a = found.ticks, "different"_a = found.different,
                    "first_different"_a = first, "is_cut_off"_a = found.is_cut_off != 0);
  }
  std::string text(int which) const {
    size_t length = 0;
    check(pal_scene_text(scene_.handle, PalSceneText(which), nullptr, 0, &length));
    std::string all(length + 1, '\0');
    check(pal_scene_text(scene_.handle, PalSceneText(which), all.data(), all.size(), nullptr));
    all.resize(length);
    return all;
  }
  std::vector<std::string> events() {
    const std::lock_guard lock(mutex_);
    return std::exchange(events_, {});
  }
  py::dict state() const {
    PalState s{};
    s.size = sizeof s;
    check(pal_session_state(session_.handle, &s));
    const auto three = [](const double v[3]) { return py::make_tuple(v[0], v[1], v[2]); };
    py::list volumes;
    using namespace py::literals;
    for (uint32_t v = 0; v < s.volume_count; ++v) {
      py::array_t<double> place({3, 4});
      std::copy(s.volumes[v].world_from_volume, s.volumes[v].world_from_volume + 12,
                place.mutable_data());
      volumes.append(py::dict("world_from_volume"_a = place, "time_s"_a = s.volumes[v].time_s,
                              "rate"_a = s.volumes[v].rate));
    }
    py::dict held;
    for (uint32_t k = 0; k < s.limiter_count; ++k)
      held[s.limiters[k].word] = three(s.limiters[k].held_n);
    return py::dict(
        "in_contact"_a = s.in_contact != 0, "hand_m"_a = three(s.hand_m),
        "proxy_m"_a = three(s.proxy_m), "force_n"_a = three(s.force_n),
        "cause"_a = std::string(s.cause), "cause_sentence"_a = std::string(s.cause_sentence),
        "can_play"_a = s.can_play != 0, "steps"_a = s.steps, "steps_known"_a = s.steps_known,
        "volumes"_a = volumes, "ticks"_a = s.ticks, "late_ticks"_a = s.late_ticks,
        "frames_received"_a = s.frames_received, "frames_felt"_a = s.frames_felt,
        "frame_delay_s"_a = s.frame_delay_s, "frame_cycle_s"_a = s.frame_cycle_s,
        "hand_work_j"_a = s.hand_work_j, "asked_n"_a = three(s.asked_n), "held_n"_a = held,
        "shaft"_a = three(s.shaft), "torque_n_m"_a = three(s.torque_n_m));
  }
  bool ask_tubes(int action) {
    return was_taken(pal_session_ask_tubes(session_.handle, PalTubesAction(action)));
  }
  void save_tubes(const std::string& path) {
    without_lock([&] { return pal_session_save_tubes(session_.handle, path.c_str()); });
  }
  py::list tubes() const {
    using namespace py::literals;
    static const char* const kFields[] = {"vectors", "gradient", "curl", "velocity"};
    py::list all;
    PalTube tube{};
    tube.size = sizeof tube;
    for (uint32_t index = 0;; ++index) {
      tube.capacity = 0;
      tube.points_m = tube.lengths = nullptr;
      PalResult result = pal_session_tube(session_.handle, index, &tube);
      check(result);
      if (result == PAL_END) return all;
      py::array_t<double> points({py::ssize_t(tube.point_count), py::ssize_t(3)});
      py::array_t<double> lengths(py::ssize_t(tube.point_count));
      const uint32_t room = tube.capacity = tube.point_count;
      tube.points_m = points.mutable_data();
      tube.lengths = lengths.mutable_data();
      result = pal_session_tube(session_.handle, index, &tube);
      check(result);
      // Another action came in between: there may be fewer tubes now, or another one at this index.
      if (result == PAL_END) return all;
      if (tube.point_count != room) {
        --index;
        continue;
      }
      all.append(py::dict("points_m"_a = points, "lengths"_a = lengths,
                          "unit"_a = std::string(tube.length_unit), "volume"_a = tube.volume,
                          "field"_a = kFields[tube.field], "seed"_a = tube.seed_point,
                          "kept"_a = tube.is_kept != 0, "closed"_a = tube.is_closed != 0));
    }
  }
  /// RGBA, shape (height, width, 4). One thread after the other.
  py::array_t<uint8_t> picture(const std::array<double, 3>& position_m,
                               const std::array<double, 4>& orientation, double tan_x, double tan_y,
                               uint32_t width, uint32_t height) {
    PalEye eye{};
    std::copy(position_m.begin(), position_m.end(), eye.position_m);
    std::copy(orientation.begin(), orientation.end(), eye.orientation);
    eye.tan_left = -tan_x;
    eye.tan_right = tan_x;
    eye.tan_down = -tan_y;
    eye.tan_up = tan_y;
    py::array_t<uint8_t> pixels({py::ssize_t(height), py::ssize_t(width), py::ssize_t(4)});
    auto* const to = reinterpret_cast<uint32_t*>(pixels.mutable_data());
    PalResult result = PAL_OK;
    without_lock([&] {
      // A thread that holds this mutex never waits for the interpreter's lock.
      const std::lock_guard lock(view_mutex_);
      result = context_->told(drawn(eye, width, height, to));
      return result;
    });
    if (result == PAL_NOT_YET) throw py::value_error(pal_last_error());
    return pixels;
  }

 private:
  void open_scene(Words words) {
    const FramesInMemory frames(words, "frames");
    first_grid_ = frames.info.grid;
    PalSceneInfo info{};
    info.size = sizeof info;
    info.flags = words.count("flags");
    const auto& paths = words.list("paths");
    info.paths = paths.data();
    info.path_count = uint32_t(paths.size());
    info.json = words.text("json");
    info.frames = &frames.info;
    info.frame_sets = frames.samples.empty() ? 0 : 1;
    info.options = words.text("options");
    without_lock([&] { return pal_scene_open(context_->handle, &info, &scene_.handle); });
  }

  void open_session(Words words) {
    PalDeviceInfo host{};
    host.size = sizeof host;
    host.name = "Python";
    host.max_force_n = words.number("device_force_n");
    host.workspace_radius_m = words.number("workspace_radius_m");
    PalSessionInfo info{};
    info.size = sizeof info;
    if (words.count("host_ticks")) {
      info.flags = PAL_SESSION_HOST_TICKS;
      info.host = &host;
    }
    info.options = words.text("options");
    info.user = this;
    info.on_event = [](void* user, PalEventKind, const char* sentence) {
      auto* const self = static_cast<PythonSession*>(user);
      const std::lock_guard lock(self->mutex_);
      self->events_.emplace_back(sentence);
    };
    without_lock([&] { return pal_session_open(scene_.handle, &info, &session_.handle); });
  }

  /// Call it without the interpreter's lock.
  PalResult end() {
    const std::lock_guard lock(view_mutex_);
    pal_view_close(&view_.handle);
    const PalResult result = pal_session_close(&session_.handle);
    pal_scene_close(&scene_.handle);
    return result;
  }

  /// Call it with view_mutex_ locked.
  PalResult drawn(const PalEye& eye, uint32_t width, uint32_t height, uint32_t* to) {
    if (!view_.handle || width != width_ || height != height_) {
      pal_view_close(&view_.handle);
      PalViewInfo info{};
      info.size = sizeof info;
      info.width = width_ = width;
      info.height = height_ = height;
      info.eye_count = 1;
      const PalResult opened = pal_view_open(session_.handle, &info, &view_.handle);
      if (opened != PAL_OK) return opened;
    }
    const PalResult result = pal_view_render(view_.handle, &eye, 1, width, height, 0.0, nullptr);
    return result == PAL_OK ? pal_view_read(view_.handle, 0, to, nullptr) : result;
  }

  std::shared_ptr<PythonContext> context_;
  std::mutex mutex_;  ///< guards events_
  std::vector<std::string> events_;
  std::mutex view_mutex_;  ///< guards the view and its size
  uint32_t width_ = 0, height_ = 0;
  PalGrid first_grid_{};  ///< of frames in memory
  UniqueHandle<PalScene, pal_scene_close> scene_;
  UniqueHandle<PalSession, pal_session_close> session_;
  UniqueHandle<PalView, pal_view_close> view_;
};

}  // namespace

PYBIND11_MODULE(_palpate, m) {
  using namespace py::literals;
  m.attr("__version__") = std::to_string(PAL_VERSION_MAJOR) + "." +
                          std::to_string(PAL_VERSION_MINOR) + "." +
                          std::to_string(PAL_VERSION_PATCH);
  m.attr("PAIRWISE") = int(PAL_ESTIMATOR_PAIRWISE);
  m.attr("CYCLIC") = int(PAL_ESTIMATOR_CYCLIC);
  m.attr("NO_VERDICT") = int(PAL_ESTIMATOR_NO_VERDICT);
  m.attr("LIVE") = int(PAL_SCENE_LIVE);
  m.def("options", &options, "The table of options of a session, as JSON.");
  py::class_<PythonContext, std::shared_ptr<PythonContext>>(m, "Context")
      .def(py::init<const std::optional<std::string>&, bool>(), "device"_a = py::none(),
           "computes"_a = true)
      .def_property_readonly("device", &PythonContext::device)
      .def_property_readonly("failed", [](const PythonContext& of) { return of.failed.load(); });
  py::class_<PythonMotion>(m, "Motion")
      .def("field", &PythonMotion::field, "step"_a, "time_s"_a, "inverse"_a)
      .def("confidence", &PythonMotion::confidence, "step"_a)
      .def("deviation", &PythonMotion::deviation, "step"_a)
      .def("warp", &PythonMotion::warp, "frame"_a, "step"_a, "time_s"_a, "inverse"_a)
      .def("save", &PythonMotion::save, "path"_a, "step"_a)
      .def("geometry", &PythonMotion::geometry)
      .def("size", &PythonMotion::size)
      .def("summary", &PythonMotion::summary);
  py::class_<PythonSequence>(m, "Sequence")
      .def(py::init<const std::vector<std::string>&, std::optional<double>>(), "paths"_a,
           "nan_as"_a)
      .def("count", &PythonSequence::count)
      .def("geometry", &PythonSequence::geometry)
      .def("size", &PythonSequence::size)
      .def("has_times", &PythonSequence::has_times)
      .def("notes", &PythonSequence::notes)
      .def("time_s", &PythonSequence::time_s, "index"_a)
      .def("frame", &PythonSequence::frame, "index"_a);
  m.def("estimate", &estimate, "context"_a, "frames"_a, "size"_a, "spacing"_a, "origin"_a,
        "direction"_a, "preset"_a, "times_s"_a, "mask"_a, "flags"_a, "progress"_a);
  m.def("open_motion", &opened_motion, "context"_a, "path"_a);
  py::class_<PythonSession>(m, "Session")
      .def(py::init<std::shared_ptr<PythonContext>, const py::dict&, const py::dict&>(),
           "context"_a, "of_scene"_a, "of_session"_a)
      .def("close", &PythonSession::close)
      .def("tick", &PythonSession::tick, "position_m"_a, "time_ns"_a = 0, "buttons"_a = 0)
      .def("torque", &PythonSession::torque)
      .def("hold", &PythonSession::hold, "rotation"_a, "angular_velocity_rad_per_s"_a,
           "opening_rad"_a)
      .def("stop", &PythonSession::stop)
      .def("at_rest", &PythonSession::at_rest)
      .def("play", &PythonSession::play, "on"_a)
      .def("scrub", &PythonSession::scrub, "share"_a)
      .def("rearm", &PythonSession::rearm)
      .def("place", &PythonSession::place, "volume"_a, "world_from_volume"_a)
      .def("set_mode", &PythonSession::set_mode, "index"_a, "on"_a, "gain"_a)
      .def("push_frame", &PythonSession::push_frame, "frame"_a, "grid"_a, "time_ns"_a)
      .def("replay", &PythonSession::replay, "recording"_a, "tubes"_a)
      .def("text", &PythonSession::text, "which"_a)
      .def("events", &PythonSession::events)
      .def("state", &PythonSession::state)
      .def("ask_tubes", &PythonSession::ask_tubes, "action"_a)
      .def("tubes", &PythonSession::tubes)
      .def("save_tubes", &PythonSession::save_tubes, "path"_a)
      .def("picture", &PythonSession::picture);
}
