#pragma once

// palpate in VTK 9.1 and 9.3: filters for the motion between images and for a moving volume. Header
// only; link palpate::palpate, VTK::CommonCore, VTK::CommonDataModel and VTK::CommonExecutionModel.
#include <palpate_adapter.h>
#include <vtkFloatArray.h>
#include <vtkImageAlgorithm.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkInformationVector.h>
#include <vtkMatrix3x3.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPointData.h>
#include <vtkStreamingDemandDrivenPipeline.h>
#include <vtkTimeStamp.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <vector>

// vtkTypeMacro ends in a semicolon too many.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"

/// The common part of vtkPalpateMotion and vtkPalpateSequence.
///
/// Images: one number per voxel, the point scalars, of any type but integers of 64 bits. Origin,
/// spacing, extent (which need not begin at 0) and DirectionMatrix are used; the unit is mm.
/// Displacements are along the axes of the images' own world. palpate calls these axes L, P, S, as
/// ITK and DICOM do. VTK gives them no names, and with some readers (NIfTI) they are R, A, S; this
/// changes the names only. Some readers ignore the direction in the file (vtkMetaImageReader and
/// vtkNIFTIImageReader of VTK 9.1): then set it, or the displacements are along the images' rows,
/// columns and slices.
///
/// The filters request whole images, they do not stream.
///
/// Errors: one sentence by vtkErrorMacro (vtkCommand::ErrorEvent), and from GetError(); the output
/// is empty and the pipeline fails (GetExecutive()->Update() returns 0). No exception is thrown to
/// the caller.
///
/// Threads: one at a time for each filter, as with every VTK filter. Progress events are sent on
/// the thread that called Update(). AbortExecuteOn(), from an observer or from another thread,
/// cancels the estimation; the pipeline fails and gives no field. VTK 9.1 clears this request when
/// the next Update() begins, VTK 9.3 keeps it until AbortExecuteOff() is called.
///
/// Filters on the same device share its context. After the device was lost, the next Update() opens
/// it again.
class vtkPalpateAlgorithm : public vtkImageAlgorithm {
 public:
  vtkTypeMacro(vtkPalpateAlgorithm, vtkImageAlgorithm);
  vtkPalpateAlgorithm(const vtkPalpateAlgorithm&) = delete;
  void operator=(const vtkPalpateAlgorithm&) = delete;

  void PrintSelf(ostream& os, vtkIndent indent) override {
    Superclass::PrintSelf(os, indent);
    os << indent << "Preset: " << preset_ << "\n"
       << indent << "Device: " << device_ << "\n"
       << indent << "Check: " << check_ << "\n"
       << indent << "Verdict: " << verdict_ << "\n";
  }

  /// The effort: "fast", "balanced" (default), "best" or "classic". Null: the default.
  void SetPreset(const char* preset) { set(preset_, std::string(preset ? preset : "balanced")); }
  const char* GetPreset() const { return preset_.c_str(); }
  /// The Vulkan device, by number or part of its name; "" (default) or null: the first GPU, else
  /// the CPU.
  void SetDevice(const char* device) { set(device_, std::string(device ? device : "")); }
  const char* GetDevice() const { return device_.c_str(); }
  /// Whether the motion is compared with the images after the estimation, see GetVerdict().
  /// Default: on. Off saves time.
  void SetCheck(bool on) { set(check_, on); }
  bool GetCheck() const { return check_; }
  void CheckOn() { SetCheck(true); }
  void CheckOff() { SetCheck(false); }

  /// After Update(): "ok", "suspect" or "failed"; "" if the motion was not checked.
  const char* GetVerdict() const { return verdict_.c_str(); }
  /// After Update(): why the verdict is not ok, one sentence per line.
  const char* GetReasons() const { return reasons_.c_str(); }
  /// Why the last Update() failed, one sentence; "" after success.
  const char* GetError() const { return error_.c_str(); }

 protected:
  vtkPalpateAlgorithm() = default;
  ~vtkPalpateAlgorithm() override = default;

  using UniqueEstimator = palpate::adapter::UniqueHandle<PalEstimator, pal_estimator_close>;
  using UniqueMotion = palpate::adapter::UniqueHandle<PalMotion, pal_motion_close>;

  /// Thrown when the user has cancelled: the filter fails without an error event.
  struct Stopped : std::runtime_error {
    using std::runtime_error::runtime_error;
  };

  /// An image in the form that palpate.h takes. Borrows the image's samples.
  struct InputImage {
    vtkImageData* image;
    PalGrid grid;
    PalSampleType type;
    const void* samples;
  };

  /// Throws Stopped or std::runtime_error if a call of palpate.h failed.
  void check(PalResult result) { check(result, result == PAL_OK ? "" : pal_last_error()); }
  void check(PalResult result, const std::string& sentence) {
    if (result == PAL_OK) return;
    if (result == PAL_CANCELLED) throw Stopped(sentence);
    // After a lost device the next Update() opens it again, also in filters that share it.
    if (result == PAL_DEVICE_FAILED && context_) {
      const std::lock_guard<std::mutex> lock(opened().mutex);
      std::weak_ptr<PalContext>& known = opened().contexts[open_device_];
      if (known.lock() == context_) known.reset();
      context_.reset();
    }
    throw std::runtime_error(sentence);
  }

  /// Changes a setting on which the motion depends.
  template <class Value>
  void set(Value& to, const Value& value) {
    if (to == value) return;
    to = value;
    changed();
  }
  void changed() {
    settings_changed_.Modified();
    this->Modified();
  }

  /// Runs `work`, which may throw. Returns 1, or 0 after an exception, which is reported as in the
  /// class comment.
  template <class Work>
  int guarded(const Work& work) {
    error_.clear();
    try {
      work();
      return 1;
    } catch (const Stopped& stopped) {
      error_ = stopped.what();
    } catch (const std::exception& failure) {
      error_ = failure.what();
      vtkErrorMacro(<< error_);
    } catch (...) {
      error_ = "An observer threw what is no std::exception";
      vtkErrorMacro(<< error_);
    }
    return 0;
  }

  /// The contexts that are open in this process, by device name.
  struct SharedHandles {
    std::mutex mutex;
    std::map<std::string, std::weak_ptr<PalContext>> contexts;
  };
  static SharedHandles& opened() {
    static SharedHandles all;
    return all;
  }

  /// The context of this filter's device, shared by all filters on it; opened if none has it.
  PalContext* context() {
    const std::lock_guard<std::mutex> lock(opened().mutex);
    std::weak_ptr<PalContext>& known = opened().contexts[device_];
    context_ = known.lock();
    if (!context_) {
      PalContextInfo info{};
      info.size = sizeof info;
      info.version = PAL_VERSION;
      info.device = device_.empty() ? nullptr : device_.c_str();
      PalContext* handle = nullptr;
      check(pal_context_open(&info, &handle));
      context_.reset(handle, [](PalContext* last) { pal_context_close(&last); });
      known = context_;
    }
    open_device_ = device_;
    return context_.get();
  }

  /// Throws for a type that palpate does not read; `name` begins the sentence.
  static PalSampleType type_of(int vtk_type, const std::string& name) {
    switch (vtk_type) {
      case VTK_FLOAT:
        return PAL_FLOAT32;
      case VTK_DOUBLE:
        return PAL_FLOAT64;
      case VTK_CHAR:
        return VTK_TYPE_CHAR_IS_SIGNED ? PAL_INT8 : PAL_UINT8;
      case VTK_SIGNED_CHAR:
        return PAL_INT8;
      case VTK_UNSIGNED_CHAR:
        return PAL_UINT8;
      case VTK_SHORT:
        return PAL_INT16;
      case VTK_UNSIGNED_SHORT:
        return PAL_UINT16;
      case VTK_INT:
        return PAL_INT32;
      case VTK_UNSIGNED_INT:
        return PAL_UINT32;
      default:
        throw std::runtime_error(name + " has scalars of type " +
                                 vtkImageScalarTypeNameMacro(vtk_type) +
                                 ", which palpate does not read: cast them with vtkImageCast");
    }
  }

  /// Throws if the image can not be used; `name` ("The fixed image") begins the sentence.
  static InputImage frame_of(vtkImageData* image, const std::string& name) {
    if (!image) throw std::runtime_error(name + " is missing");
    vtkDataArray* const scalars = image->GetPointData()->GetScalars();
    if (!scalars) throw std::runtime_error(name + " has no scalars at its points");
    if (scalars->GetNumberOfComponents() != 1)
      throw std::runtime_error(name + " has " + std::to_string(scalars->GetNumberOfComponents()) +
                               " values per voxel: take one with vtkImageExtractComponents");
    if (scalars->GetNumberOfTuples() != image->GetNumberOfPoints())
      throw std::runtime_error(name + " has not as many scalars as points");
    InputImage frame{image, {}, type_of(scalars->GetDataType(), name), scalars->GetVoidPointer(0)};
    const int* const extent = image->GetExtent();
    image->TransformIndexToPhysicalPoint(extent[0], extent[2], extent[4], frame.grid.origin_mm);
    for (int a = 0; a < 3; ++a) {
      frame.grid.size[a] = uint32_t(extent[2 * a + 1] - extent[2 * a] + 1);
      frame.grid.spacing_mm[a] = image->GetSpacing()[a];
      for (int row = 0; row < 3; ++row)
        frame.grid.direction[3 * row + a] = image->GetDirectionMatrix()->GetElement(row, a);
    }
    return frame;
  }

  /// True if two grids have samples at the same places, to a thousandth of the finest voxel edge.
  static bool is_same(const PalGrid& one, const PalGrid& other) {
    double voxel = std::numeric_limits<double>::infinity();
    for (int a = 0; a < 3; ++a) {
      if (one.size[a] != other.size[a]) return false;
      voxel = std::min(voxel, one.spacing_mm[a]);
    }
    for (unsigned corner = 0; corner < 8; ++corner) {
      double squares = 0.0;
      for (int row = 0; row < 3; ++row) {
        double apart = one.origin_mm[row] - other.origin_mm[row];
        for (int a = 0; a < 3; ++a)
          if (corner >> a & 1U)
            apart += double(one.size[a] - 1) * (one.direction[3 * row + a] * one.spacing_mm[a] -
                                                other.direction[3 * row + a] * other.spacing_mm[a]);
        squares += apart * apart;
      }
      if (!(std::sqrt(squares) <= 1e-3 * voxel)) return false;
    }
    return true;
  }

  /// The samples of the mask at a port; null without a mask. Throws for another grid or type.
  static const uint8_t* mask_of(vtkInformationVector* port, const PalGrid& grid) {
    if (port->GetNumberOfInformationObjects() == 0) return nullptr;
    const InputImage mask = frame_of(vtkImageData::GetData(port), "The mask");
    if (mask.type != PAL_UINT8)
      throw std::runtime_error("The mask has other scalars than unsigned char");
    if (!is_same(mask.grid, grid))
      throw std::runtime_error("The mask is not on the grid of the images");
    return static_cast<const uint8_t*>(mask.samples);
  }

  /// Estimates the motion between frames on one grid. `times_s`: the time of each frame, rising
  /// from 0. `flags`: PAL_ESTIMATOR_...
  void estimate(const std::vector<InputImage>& frames, const std::vector<double>& times_s,
                uint32_t flags, const uint8_t* mask, PalMotion*& motion) {
    verdict_.clear();
    reasons_.clear();
    // The estimator's callback writes to it: it must outlive the estimator.
    std::atomic<double> share{0.0};
    UniqueEstimator estimator;
    PalEstimatorInfo info{};
    info.size = sizeof info;
    info.flags = flags | (check_ ? 0U : uint32_t(PAL_ESTIMATOR_NO_VERDICT));
    info.grid = frames.front().grid;
    info.preset = preset_.c_str();
    info.mask = mask;
    info.on_progress = [](void* user, const char*, double now) {
      static_cast<std::atomic<double>*>(user)->store(now);
    };
    info.user = &share;
    check(pal_estimator_open(context(), &info, &estimator.handle));
    for (size_t k = 0; k < frames.size(); ++k)
      check(pal_estimator_push(estimator.handle, frames[k].type, frames[k].samples, times_s[k]));
    wait_for(estimator.handle, motion, share);
    take_verdict(motion);
  }

  void take_verdict(const PalMotion* motion) {
    const PalMotionSummary summary = summary_of(motion);
    verdict_ = summary.trust_word;
    reasons_ = summary.reasons;
  }

  PalMotionSummary summary_of(const PalMotion* motion) {
    PalMotionSummary summary{};
    summary.size = sizeof summary;
    check(pal_motion_summary(motion, &summary));
    return summary;
  }

  static vtkInformation* input(vtkInformationVector** inputs, int port, int connection) {
    return inputs[port]->GetInformationObject(connection);
  }

  /// Requests the whole extent of every input.
  int RequestUpdateExtent(vtkInformation*, vtkInformationVector** inputs,
                          vtkInformationVector*) override {
    using Pipeline = vtkStreamingDemandDrivenPipeline;
    for (int port = 0; port < this->GetNumberOfInputPorts(); ++port)
      for (int k = 0; k < inputs[port]->GetNumberOfInformationObjects(); ++k) {
        vtkInformation* const info = input(inputs, port, k);
        if (!info->Has(Pipeline::WHOLE_EXTENT())) continue;
        int extent[6];
        info->Get(Pipeline::WHOLE_EXTENT(), extent);
        info->Set(Pipeline::UPDATE_EXTENT(), extent, 6);
      }
    return 1;
  }

  /// Announces an output with the geometry of the first input and `components` floats per voxel.
  static void promise(vtkInformationVector** inputs, vtkInformation* output, int components) {
    vtkInformation* const first = input(inputs, 0, 0);
    output->CopyEntry(first, vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT());
    output->CopyEntry(first, vtkDataObject::SPACING());
    output->CopyEntry(first, vtkDataObject::ORIGIN());
    output->CopyEntry(first, vtkDataObject::DIRECTION());
    vtkDataObject::SetPointDataActiveScalarInfo(output, VTK_FLOAT, components);
  }

  /// A new array with one tuple per voxel of the image.
  static vtkNew<vtkFloatArray> array(const char* name, int components, vtkImageData* image) {
    vtkNew<vtkFloatArray> values;
    values->SetName(name);
    values->SetNumberOfComponents(components);
    values->SetNumberOfTuples(image->GetNumberOfPoints());
    return values;
  }

  vtkMTimeType settings_changed() const { return settings_changed_.GetMTime(); }

  std::string verdict_, reasons_;

 private:
  /// Waits for the motion; another thread estimates, so that observers are called on this one.
  void wait_for(PalEstimator* estimator, PalMotion*& motion, const std::atomic<double>& share) {
    const auto [result, sentence] = palpate::adapter::finish(
        estimator, motion, share, [this](double now) { this->UpdateProgress(now); },
        [this] { return this->GetAbortExecute() != 0; });
    check(result, sentence);
  }

  std::string preset_ = "balanced", device_, error_;
  bool check_ = true;
  vtkTimeStamp settings_changed_;
  std::shared_ptr<PalContext> context_;
  std::string open_device_;
};

/// Estimates the displacement field between two images, on a Vulkan device.
///
///   vtkNew<vtkPalpateMotion> motion;
///   motion->SetInputConnection(0, fixed->GetOutputPort());
///   motion->SetInputConnection(1, moving->GetOutputPort());
///   motion->Update();
///   motion->GetOutput();   // "displacement" and more at the fixed image's voxels
///
/// Inputs: 0 the fixed image; 1 the moving image on the same grid (another grid is an error, since
/// vtkImageReslice of 9.1 ignores directions); 2, optional, a mask of unsigned char on the same
/// grid: where it is 0 the images are ignored. Draw it 10 voxels wider than the part that you need.
///
/// Output: an image with the fixed one's extent, origin, spacing and DirectionMatrix. Its scalars
/// and vectors are "displacement", three floats, mm along the axes of the world (not of the image's
/// rows): the material at x of the fixed image is at x + u(x) in the moving one. Its point data
/// also contain "confidence", one float, 0 to 1: the share of similar vectors that are right within
/// half a voxel. And "deviation", two floats, mm: the standard deviation of the vector's error,
/// along the image gradient, where the images show motion best, and in each direction across it.
class vtkPalpateMotion : public vtkPalpateAlgorithm {
 public:
  vtkTypeMacro(vtkPalpateMotion, vtkPalpateAlgorithm);
  static vtkPalpateMotion* New() { VTK_STANDARD_NEW_BODY(vtkPalpateMotion); }

 protected:
  vtkPalpateMotion() { this->SetNumberOfInputPorts(3); }
  ~vtkPalpateMotion() override = default;

  int FillInputPortInformation(int port, vtkInformation* info) override {
    info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkImageData");
    if (port == 2) info->Set(vtkAlgorithm::INPUT_IS_OPTIONAL(), 1);
    return 1;
  }

  int RequestInformation(vtkInformation*, vtkInformationVector** inputs,
                         vtkInformationVector* outputs) override {
    promise(inputs, outputs->GetInformationObject(0), 3);
    return 1;
  }

  int RequestData(vtkInformation*, vtkInformationVector** inputs,
                  vtkInformationVector* outputs) override {
    vtkImageData* const output = vtkImageData::GetData(outputs);
    const int done = guarded([&] {
      const std::vector<InputImage> frames = {
          frame_of(vtkImageData::GetData(inputs[0]), "The fixed image"),
          frame_of(vtkImageData::GetData(inputs[1]), "The moving image")};
      if (!is_same(frames[0].grid, frames[1].grid))
        throw std::runtime_error(
            "The moving image is not on the grid of the fixed one: resample it to that grid first");
      UniqueMotion motion;
      estimate(frames, {0.0, 1.0}, 0, mask_of(inputs[2], frames[0].grid), motion.handle);
      PalFieldInfo step{};
      step.size = sizeof step;
      const auto field = array("displacement", 3, frames[0].image);
      check(pal_motion_field(motion.handle, &step, field->GetPointer(0)));
      const auto confidence = array("confidence", 1, frames[0].image);
      check(pal_motion_confidence(motion.handle, &step, confidence->GetPointer(0)));
      const auto deviation = array("deviation", 2, frames[0].image);
      deviation->SetComponentName(0, "along the gradient");
      deviation->SetComponentName(1, "across it");
      check(pal_motion_deviation(motion.handle, &step, deviation->GetPointer(0)));
      output->CopyStructure(frames[0].image);
      output->GetPointData()->SetScalars(field);
      output->GetPointData()->SetVectors(field);
      output->GetPointData()->AddArray(confidence);
      output->GetPointData()->AddArray(deviation);
    });
    if (!done) output->Initialize();
    return done;
  }
};

/// A moving volume: gives the volume at a time or a phase. From three or more frames palpate
/// estimates one motion, on a Vulkan device, and chooses a reference frame; the output is that
/// frame, warped by the motion.
///
///   vtkNew<vtkPalpateSequence> sequence;
///   for (auto& reader : readers) sequence->AddInputConnection(reader->GetOutputPort());
///   sequence->CyclicOn();
///   sequence->SetCycle(0.8);
///   mapper->SetInputConnection(sequence->GetOutputPort());
///   sequence->SetPhase(0.25);   // any number of times: the motion is estimated once
///
/// Inputs: 0 the frames in order (repeated connections), all on one grid; 1, optional, a mask of
/// unsigned char on that grid: where it is 0 the frames are ignored.
///
/// Output: an image with the first frame's extent, origin, spacing and DirectionMatrix, and the
/// values of the reference frame at that time as scalars, one float.
///
/// The motion is estimated when it is first needed, and again when a frame, the mask or one of the
/// settings was modified. Another phase needs no new estimation. Do not release the frames'
/// data meanwhile (ReleaseDataFlag): frames that are read again count as modified.
///
/// Time of the output: that of the pipeline's request (UpdateTimeStep(), the time of an animation);
/// without one, the last of SetTime() and SetPhase(). The filter publishes TIME_STEPS, the frames'
/// times, and TIME_RANGE.
class vtkPalpateSequence : public vtkPalpateAlgorithm {
 public:
  vtkTypeMacro(vtkPalpateSequence, vtkPalpateAlgorithm);
  static vtkPalpateSequence* New() { VTK_STANDARD_NEW_BODY(vtkPalpateSequence); }

  void PrintSelf(ostream& os, vtkIndent indent) override {
    Superclass::PrintSelf(os, indent);
    os << indent << "Cyclic: " << cyclic_ << "\n"
       << indent << "Cycle: " << cycle_s_ << "\n"
       << indent << (by_phase_ ? "Phase: " : "Time: ") << (by_phase_ ? phase_ : time_s_) << "\n"
       << indent << "MotionFile: " << motion_file_ << "\n";
  }

  /// Whether the last frame leads back to the first. Default: off.
  void SetCyclic(bool on) { set(cyclic_, on); }
  bool GetCyclic() const { return cyclic_; }
  void CyclicOn() { SetCyclic(true); }
  void CyclicOff() { SetCyclic(false); }

  /// The length of the cycle, s; without a cycle, the time from the first frame to the last. The
  /// frames are evenly spaced, the first one at 0. 0 (default): one frame per second. Not used if
  /// SetFrameTime() was called.
  void SetCycle(double seconds) {
    if (std::isfinite(seconds) && seconds >= 0.0)
      set(cycle_s_, seconds);
    else
      vtkErrorMacro("A cycle lasts longer than 0 s");
  }
  double GetCycle() const { return cycle_s_; }

  /// The time of a frame (from 0), s, rising from frame to frame. Set it for all frames or for
  /// none. A cycle then ends one step (the median one) after the last frame.
  void SetFrameTime(int frame, double seconds) {
    if (frame < 0) {
      vtkErrorMacro("Frames are counted from 0");
      return;
    }
    if (size_t(frame) >= frame_times_.size())
      frame_times_.resize(size_t(frame) + 1, std::numeric_limits<double>::quiet_NaN());
    set(frame_times_[size_t(frame)], seconds);
  }
  void ClearFrameTimes() { set(frame_times_, std::vector<double>()); }

  /// The time of the output, s, on the same clock as the frames' times. Outside a sequence that is
  /// not cyclic the output is that of the nearer end.
  void SetTime(double seconds) { show(false, seconds, time_s_); }
  double GetTime() const { return time_s_; }
  /// The time of the output as a share, 0 to 1, of the cycle; without a cycle, of the time from the
  /// first frame to the last. Default: 0.
  void SetPhase(double phase) { show(true, phase, phase_); }
  double GetPhase() const { return phase_; }

  /// Reads the motion from this file (.nrrd), written by `palpate motion` or pal_motion_save(),
  /// instead of estimating it. Connect all frames, or only the reference frame, see
  /// GetReferenceFrame(). Times are those of the file, from the first frame on, and the file says
  /// whether there is a cycle; without a cycle a phase needs SetCycle(). Set the file again to read
  /// it again; "" (default) or null: no file.
  void SetMotionFile(const char* path) {
    motion_file_ = path ? path : "";
    changed();
  }
  const char* GetMotionFile() const { return motion_file_.c_str(); }

  /// The number of the frame that is warped, from 0. Known after Update(), with a motion file after
  /// UpdateInformation(); before that -1.
  int GetReferenceFrame() const { return motion_ ? int(summary_.reference_frame) : -1; }
  /// After Update(): the time of the output, s.
  double GetOutputTime() const { return output_time_s_; }

 protected:
  vtkPalpateSequence() { this->SetNumberOfInputPorts(2); }
  ~vtkPalpateSequence() override = default;

  int FillInputPortInformation(int port, vtkInformation* info) override {
    info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkImageData");
    if (port == 0) info->Set(vtkAlgorithm::INPUT_IS_REPEATABLE(), 1);
    if (port == 1) info->Set(vtkAlgorithm::INPUT_IS_OPTIONAL(), 1);
    return 1;
  }

  int RequestInformation(vtkInformation*, vtkInformationVector** inputs,
                         vtkInformationVector* outputs) override {
    using Pipeline = vtkStreamingDemandDrivenPipeline;
    vtkInformation* const output = outputs->GetInformationObject(0);
    promise(inputs, output, 1);
    return guarded([&] {
      std::vector<double> times;
      if (has_file())
        read_motion();
      else
        times = times_of(size_t(inputs[0]->GetNumberOfInformationObjects()));
      const double begin = times.empty() ? 0.0 : times.front(), length = length_of(times);
      const double range[2] = {begin, begin + length};
      output->Remove(Pipeline::TIME_STEPS());
      output->Remove(Pipeline::TIME_RANGE());
      if (length > 0.0) output->Set(Pipeline::TIME_RANGE(), range, 2);
      if (!times.empty()) output->Set(Pipeline::TIME_STEPS(), times.data(), int(times.size()));
    });
  }

  /// Requests the frames without a time: the requested time is for this filter only.
  int RequestUpdateExtent(vtkInformation* request, vtkInformationVector** inputs,
                          vtkInformationVector* outputs) override {
    for (int port = 0; port < 2; ++port)
      for (int k = 0; k < inputs[port]->GetNumberOfInformationObjects(); ++k)
        input(inputs, port, k)->Remove(vtkStreamingDemandDrivenPipeline::UPDATE_TIME_STEP());
    return Superclass::RequestUpdateExtent(request, inputs, outputs);
  }

  int RequestData(vtkInformation*, vtkInformationVector** inputs,
                  vtkInformationVector* outputs) override {
    vtkInformation* const wanted = outputs->GetInformationObject(0);
    vtkImageData* const output = vtkImageData::GetData(outputs);
    const int done = guarded([&] {
      std::vector<double> times;
      if (!has_file()) times = times_of(size_t(inputs[0]->GetNumberOfInformationObjects()));
      const InputImage frame = has_file() ? given_reference(inputs) : find_motion(inputs, times);
      const double begin = times.empty() ? 0.0 : times.front(), length = length_of(times);
      if (wanted->Has(vtkStreamingDemandDrivenPipeline::UPDATE_TIME_STEP())) {
        output_time_s_ = wanted->Get(vtkStreamingDemandDrivenPipeline::UPDATE_TIME_STEP());
      } else if (!by_phase_) {
        output_time_s_ = time_s_;
      } else {
        if (!(length > 0.0) && phase_ != 0.0)
          throw std::runtime_error(
              "The motion file has no cycle, so it does not say how long the sequence lasts: set "
              "the cycle, or a time instead of a phase");
        output_time_s_ = begin + phase_ * length;
      }
      const char* const name = frame.image->GetPointData()->GetScalars()->GetName();
      const auto values = array(name ? name : "ImageScalars", 1, frame.image);
      carry(frame, output_time_s_ - begin, values->GetPointer(0));
      output->CopyStructure(vtkImageData::GetData(inputs[0]));
      output->GetPointData()->SetScalars(values);
      output->GetInformation()->Set(vtkDataObject::DATA_TIME_STEP(), output_time_s_);
    });
    if (!done) output->Initialize();
    return done;
  }

 private:
  /// Sets the time or the phase of the output, and drops the pipeline's request of a time.
  void show(bool by_phase, double value, double& to) {
    if (!std::isfinite(value)) {
      vtkErrorMacro("A time or a phase must be a number");
      return;
    }
    vtkInformation* const output = this->GetOutputInformation(0);
    const bool was_asked = output->Has(vtkStreamingDemandDrivenPipeline::UPDATE_TIME_STEP());
    if (by_phase_ == by_phase && to == value && !was_asked) return;
    output->Remove(vtkStreamingDemandDrivenPipeline::UPDATE_TIME_STEP());
    by_phase_ = by_phase;
    to = value;
    this->Modified();
  }

  bool has_file() const { return !motion_file_.empty(); }
  /// True if the motion was estimated or read with the present settings.
  bool is_current() const { return motion_ && known_.front() == settings_changed(); }

  /// The times of the frames, s. Throws if those that were set do not fit.
  std::vector<double> times_of(size_t frames) const {
    if (!frame_times_.empty()) {
      if (frame_times_.size() != frames)
        throw std::runtime_error("There are " + std::to_string(frames) + " frames, but times of " +
                                 std::to_string(frame_times_.size()));
      for (size_t k = 0; k < frames; ++k)
        if (!std::isfinite(frame_times_[k]) || (k > 0 && frame_times_[k] <= frame_times_[k - 1]))
          throw std::runtime_error("The times of frames must rise, and be given for every frame");
      return frame_times_;
    }
    const double steps = double(cyclic_ ? frames : std::max<size_t>(frames, 2) - 1);
    std::vector<double> times(frames);
    for (size_t k = 0; k < frames; ++k)
      times[k] = (cycle_s_ > 0.0 ? cycle_s_ / steps : 1.0) * double(k);
    return times;
  }

  /// The time from phase 0 to phase 1, s; 0: not known. `times_s`: times of the frames; not used
  /// with a file.
  double length_of(const std::vector<double>& times_s) const {
    if (is_current() && summary_.cycle_s > 0.0) return summary_.cycle_s;
    if (has_file()) return cycle_s_;
    if (times_s.size() < 2) return 0.0;
    const double span = times_s.back() - times_s.front();
    if (!cyclic_) return span;
    std::vector<double> steps;
    for (size_t k = 1; k < times_s.size(); ++k) steps.push_back(times_s[k] - times_s[k - 1]);
    const auto middle = steps.begin() + ptrdiff_t((steps.size() - 1) / 2);
    std::nth_element(steps.begin(), middle, steps.end());
    return span + *middle;
  }

  void read_motion() {
    if (is_current()) return;
    forget();
    auto read = std::make_unique<UniqueMotion>();
    check(pal_motion_open(context(), motion_file_.c_str(), &read->handle));
    keep(std::move(read), {settings_changed()});
  }

  /// Reads the motion file and returns its reference frame. Throws if the inputs do not fit.
  InputImage given_reference(vtkInformationVector** inputs) {
    read_motion();
    const int given = inputs[0]->GetNumberOfInformationObjects();
    const auto all = int(summary_.frame_count), reference = int(summary_.reference_frame);
    if (given != 1 && given != all)
      throw std::runtime_error("The motion file has " + std::to_string(all) + " frames, but " +
                               std::to_string(given) + " are connected: connect all, or frame " +
                               std::to_string(reference) + " alone, counted from 0");
    const InputImage frame = frame_of(vtkImageData::GetData(inputs[0], given == 1 ? 0 : reference),
                                      "The reference frame");
    if (!fills(frame.grid, summary_.grid))
      throw std::runtime_error(
          "The reference frame does not lie where the motion file does: some readers of VTK leave "
          "out the direction, so set it");
    return frame;
  }

  /// True if two grids cover the same box, to the diagonal of a voxel of `coarse`: a file's motion
  /// has a coarser grid than its frames.
  static bool fills(const PalGrid& fine, const PalGrid& coarse) {
    double voxel = 0.0;
    for (const double spacing : coarse.spacing_mm) voxel += spacing * spacing;
    for (unsigned corner = 0; corner < 8; ++corner) {
      double squares = 0.0;
      for (int row = 0; row < 3; ++row) {
        double apart = fine.origin_mm[row] - coarse.origin_mm[row];
        for (int a = 0; a < 3; ++a) {
          const bool is_end = corner >> a & 1U;
          const auto place = [&](const PalGrid& grid) {
            return (is_end ? double(grid.size[a]) - 0.5 : -0.5) * grid.spacing_mm[a] *
                   grid.direction[3 * row + a];
          };
          apart += place(fine) - place(coarse);
        }
        squares += apart * apart;
      }
      if (!(squares <= voxel)) return false;
    }
    return true;
  }

  /// Warps the reference frame to the time `time_s` after the first frame.
  void carry(const InputImage& frame, double time_s, float* values) {
    PalFieldInfo then{};
    then.size = sizeof then;
    then.flags = PAL_FIELD_TO_TIME | PAL_FIELD_INVERSE;
    then.time_s = time_s;
    // The output has the frame's grid; that of a file's motion is coarser.
    then.grid = &frame.grid;
    check(pal_motion_warp(motion_->handle, &then, frame.type, frame.samples, values));
  }

  /// Estimates the motion unless it is known, and returns the reference frame.
  InputImage find_motion(vtkInformationVector** inputs, const std::vector<double>& times) {
    const int count = inputs[0]->GetNumberOfInformationObjects();
    if (count < 3)
      throw std::runtime_error("A sequence has three frames or more, but " + std::to_string(count) +
                               " are connected: vtkPalpateMotion takes two");
    std::vector<InputImage> frames;
    std::vector<vtkMTimeType> stamps = {settings_changed()};
    for (int k = 0; k < count; ++k) {
      frames.push_back(frame_of(vtkImageData::GetData(inputs[0], k), "Frame " + std::to_string(k)));
      if (!is_same(frames.back().grid, frames.front().grid))
        throw std::runtime_error("Frame " + std::to_string(k) +
                                 " is not on the grid of frame 0: resample it to that grid first");
      stamps.push_back(frames.back().image->GetMTime());
    }
    if (vtkImageData* const mask = vtkImageData::GetData(inputs[1]))
      stamps.push_back(mask->GetMTime());
    if (!motion_ || known_ != stamps) {
      forget();
      std::vector<double> since_first;
      for (const double time_s : times) since_first.push_back(time_s - times.front());
      auto found = std::make_unique<UniqueMotion>();
      estimate(frames, since_first, cyclic_ ? uint32_t(PAL_ESTIMATOR_CYCLIC) : 0U,
               mask_of(inputs[1], frames.front().grid), found->handle);
      keep(std::move(found), std::move(stamps));
    }
    return frames[summary_.reference_frame];
  }

  void forget() {
    motion_.reset();
    summary_ = {};
    verdict_.clear();
    reasons_.clear();
  }
  void keep(std::unique_ptr<UniqueMotion> motion, std::vector<vtkMTimeType> stamps) {
    summary_ = summary_of(motion->handle);
    take_verdict(motion->handle);
    motion_ = std::move(motion);
    known_ = std::move(stamps);
  }

  bool cyclic_ = false;
  double cycle_s_ = 0.0;
  std::vector<double> frame_times_;
  bool by_phase_ = true;
  double phase_ = 0.0, time_s_ = 0.0, output_time_s_ = 0.0;
  std::string motion_file_;
  std::unique_ptr<UniqueMotion> motion_;  ///< null: not known
  PalMotionSummary summary_{};            ///< of motion_
  /// Modification times of the settings, and of the inputs if estimated, that motion_ belongs to.
  std::vector<vtkMTimeType> known_;
};

#pragma GCC diagnostic pop
