#pragma once

// palpate in ITK 5: a filter with the methods of itk::DemonsRegistrationFilter. Header only; link
// palpate::palpate and ITK.
#include <itkCommand.h>
#include <itkImage.h>
#include <itkImageToImageFilter.h>
#include <itkLinearInterpolateImageFunction.h>
#include <itkNearestNeighborExtrapolateImageFunction.h>
#include <itkResampleImageFilter.h>
#include <palpate_adapter.h>

#include <algorithm>
#include <atomic>
#include <string>
#include <type_traits>
#include <vector>

namespace palpate::itk {

/// The PalSampleType of a pixel; a type that palpate does not read does not compile.
template <class Pixel>
constexpr PalSampleType sample_type() {
  static_assert(std::is_arithmetic_v<Pixel>, "palpate reads images of one number per pixel");
  if constexpr (std::is_floating_point_v<Pixel>) {
    static_assert(sizeof(Pixel) == 4 || sizeof(Pixel) == 8, "palpate reads float and double");
    return sizeof(Pixel) == 4 ? PAL_FLOAT32 : PAL_FLOAT64;
  } else {
    static_assert(sizeof(Pixel) <= 4, "palpate reads whole numbers of up to 32 bits");
    constexpr bool is_signed = std::is_signed_v<Pixel>;
    if constexpr (sizeof(Pixel) == 1) return is_signed ? PAL_INT8 : PAL_UINT8;
    if constexpr (sizeof(Pixel) == 2) return is_signed ? PAL_INT16 : PAL_UINT16;
    return is_signed ? PAL_INT32 : PAL_UINT32;
  }
}

/// The displacement field between two 3D images, by palpate on the GPU. It takes the place of
/// itk::DemonsRegistrationFilter: the same methods, the same output, mm along L, P, S on the fixed
/// image's grid, which itk::WarpImageFilter and itk::DisplacementFieldTransform take: the material
/// at x of the fixed image is at x + u(x) in the moving one.
///
///   using Filter = palpate::itk::MotionFilter<Image, Image, Field>;
///   auto filter = Filter::New();
///   filter->SetFixedImage(fixed);
///   filter->SetMovingImage(moving);
///   filter->Update();
///   Field* field = filter->GetDisplacementField();
///
/// The filter requests whole images, it does not stream. A moving image on another grid is
/// resampled onto the fixed one's (linear, border values clamped). No histogram matching or
/// smoothing is needed before. Observers get itk::ProgressEvent and itk::IterationEvent on the
/// thread that called Update(). Each may call StopRegistration() or AbortGenerateDataOn(); Update()
/// then throws itk::ProcessAborted, since there is no field yet. A failure throws
/// itk::ExceptionObject with one sentence; so does a method of the Demons filter that has no
/// meaning here. After the Vulkan device was lost the next Update() opens it again. Like every ITK
/// filter, one thread at a time.
template <class TFixedImage, class TMovingImage, class TDisplacementField>
class MotionFilter : public ::itk::ImageToImageFilter<TFixedImage, TDisplacementField> {
 public:
  ITK_DISALLOW_COPY_AND_MOVE(MotionFilter);
  static constexpr unsigned int ImageDimension = TFixedImage::ImageDimension;
  static_assert(ImageDimension == 3 && TMovingImage::ImageDimension == 3 &&
                    TDisplacementField::ImageDimension == 3,
                "palpate registers images of three axes");
  static_assert(TDisplacementField::PixelType::Dimension == 3,
                "A displacement has three components");

  using Self = MotionFilter;
  using Superclass = ::itk::ImageToImageFilter<TFixedImage, TDisplacementField>;
  using Pointer = ::itk::SmartPointer<Self>;
  using ConstPointer = ::itk::SmartPointer<const Self>;
// This macro ends in a semicolon too many in some versions of ITK.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
  itkNewMacro(Self);
#pragma GCC diagnostic pop
  itkTypeMacro(MotionFilter, ImageToImageFilter);

  using FixedImageType = TFixedImage;
  using MovingImageType = TMovingImage;
  using DisplacementFieldType = TDisplacementField;
  using MaskImageType = ::itk::Image<unsigned char, 3>;
  using ConfidenceImageType = ::itk::Image<float, 3>;
  using StandardDeviationsType = ::itk::FixedArray<double, 3>;

  itkSetInputMacro(FixedImage, FixedImageType);
  itkGetInputMacro(FixedImage, FixedImageType);
  itkSetInputMacro(MovingImage, MovingImageType);
  itkGetInputMacro(MovingImage, MovingImageType);
  /// On the fixed image's grid: where it is 0 the images do not count. Draw it 10 voxels wider than
  /// needed.
  itkSetInputMacro(MaskImage, MaskImageType);
  itkGetInputMacro(MaskImage, MaskImageType);
  TDisplacementField* GetDisplacementField() {
    return this->GetOutput();
  }

  /// "fast", "balanced" (the usual), "best" or "classic".
  itkSetStringMacro(Preset);
  itkGetStringMacro(Preset);
  /// A Vulkan device, by number or part of its name; "": the first GPU, else the CPU.
  itkSetStringMacro(Device);
  itkGetStringMacro(Device);
  /// Whether the field is checked against the images after it was found, which takes about as long
  /// again (the usual: on), see GetVerdict().
  itkSetMacro(Check, bool);
  itkGetConstMacro(Check, bool);
  itkBooleanMacro(Check);
  /// At most this many on each level of the pyramid; 0 (the default): as the preset has it.
  itkSetMacro(NumberOfIterations, ::itk::IdentifierType);
  itkGetConstMacro(NumberOfIterations, ::itk::IdentifierType);
  /// How many times itk::IterationEvent was sent so far.
  itkGetConstMacro(ElapsedIterations, ::itk::IdentifierType);

  /// Ends the work: Update() throws itk::ProcessAborted. Any thread.
  virtual void StopRegistration() {
    stop_ = true;
  }

  /// After Update(): "ok", "suspect" or "failed", or "" where it was not checked.
  itkGetStringMacro(Verdict);
  /// Why the verdict is not ok, a sentence per line.
  itkGetStringMacro(Reasons);
  /// After Update(): how far to trust each vector, 0 (a guess) to 1, on the fixed image's grid.
  ConfidenceImageType* GetConfidence() {
    return confidence_;
  }
  /// After Update(): the mean squared difference between the fixed image and the moving one that
  /// was warped by the field, over all of the fixed image.
  double GetMetric() const {
    return metric_;
  }

  // Methods of the Demons filter that have no meaning here.
  void SetInitialDisplacementField(const TDisplacementField*) {
    refuse("InitialDisplacementField");
  }
  void SetStandardDeviations(const StandardDeviationsType&) {
    refuse("StandardDeviations");
  }
  void SetStandardDeviations(double) {
    refuse("StandardDeviations");
  }
  void SetUpdateFieldStandardDeviations(const StandardDeviationsType&) {
    refuse("UpdateFieldStandardDeviations");
  }
  void SetUpdateFieldStandardDeviations(double) {
    refuse("UpdateFieldStandardDeviations");
  }
  void SetSmoothDisplacementField(bool) {
    refuse("SmoothDisplacementField");
  }
  void SmoothDisplacementFieldOn() {
    refuse("SmoothDisplacementField");
  }
  void SmoothDisplacementFieldOff() {
    refuse("SmoothDisplacementField");
  }
  void SetSmoothUpdateField(bool) {
    refuse("SmoothUpdateField");
  }
  void SmoothUpdateFieldOn() {
    refuse("SmoothUpdateField");
  }
  void SmoothUpdateFieldOff() {
    refuse("SmoothUpdateField");
  }
  void SetMaximumError(double) {
    refuse("MaximumError");
  }
  void SetMaximumKernelWidth(unsigned int) {
    refuse("MaximumKernelWidth");
  }
  void SetMaximumRMSError(double) {
    refuse("MaximumRMSError");
  }
  void SetUseMovingImageGradient(bool) {
    refuse("UseMovingImageGradient");
  }
  void UseMovingImageGradientOn() {
    refuse("UseMovingImageGradient");
  }
  void UseMovingImageGradientOff() {
    refuse("UseMovingImageGradient");
  }
  void SetIntensityDifferenceThreshold(double) {
    refuse("IntensityDifferenceThreshold");
  }
  /// Spacing is always used.
  void SetUseImageSpacing(bool on) {
    if (!on) refuse("UseImageSpacing off");
  }
  void UseImageSpacingOn() {}
  void UseImageSpacingOff() {
    refuse("UseImageSpacing off");
  }

 protected:
  MotionFilter() {
    this->SetPrimaryInputName("FixedImage");
    this->AddRequiredInputName("MovingImage", 1);
  }
  ~MotionFilter() override {
    pal_context_close(&context_);
  }

  /// The images may lie on different grids.
  void VerifyInputInformation() ITKv5_CONST override {}

  void GenerateInputRequestedRegion() override {
    Superclass::GenerateInputRequestedRegion();
    for (const auto& name : this->GetInputNames())
      if (auto* const input = ::itk::ProcessObject::GetInput(name))
        input->SetRequestedRegionToLargestPossibleRegion();
  }
  void EnlargeOutputRequestedRegion(::itk::DataObject* output) override {
    output->SetRequestedRegionToLargestPossibleRegion();
  }

  void GenerateData() override {
    stop_ = false;
    m_ElapsedIterations = 0;
    const auto* const fixed = this->GetFixedImage();
    const PalGrid grid = grid_of(*fixed);
    if (!context_ || open_device_ != m_Device) open_context();
    // Its address is the observer's `user`: it must outlive the estimator.
    std::atomic<double> share{0.0};
    adapter::UniqueHandle<PalEstimator, pal_estimator_close> estimator;
    adapter::UniqueHandle<PalMotion, pal_motion_close> motion;
    PalEstimatorInfo info{};
    info.size = sizeof info;
    info.flags = m_Check ? 0U : uint32_t(PAL_ESTIMATOR_NO_VERDICT);
    info.grid = grid;
    info.preset = m_Preset.c_str();
    info.mask = mask_on(*fixed);
    info.iterations = uint32_t(m_NumberOfIterations);
    info.on_progress = [](void* user, const char*, double now) {
      static_cast<std::atomic<double>*>(user)->store(now);
    };
    info.user = &share;
    check(pal_estimator_open(context_, &info, &estimator.handle));
    check(pal_estimator_push(estimator.handle, sample_type<typename TFixedImage::PixelType>(),
                             fixed->GetBufferPointer(), 0.0));
    const auto moving = moving_on(*fixed);
    check(pal_estimator_push(estimator.handle, sample_type<typename TMovingImage::PixelType>(),
                             moving->GetBufferPointer(), 1.0));
    wait_for(estimator.handle, motion.handle, share);
    take(motion.handle, *fixed, *moving);
  }

  void PrintSelf(std::ostream& os, ::itk::Indent indent) const override {
    Superclass::PrintSelf(os, indent);
    os << indent << "Preset: " << m_Preset << "\n"
       << indent << "Device: " << m_Device << "\n"
       << indent << "Check: " << m_Check << "\n"
       << indent << "NumberOfIterations: " << m_NumberOfIterations << "\n"
       << indent << "Verdict: " << m_Verdict << "\n";
  }

 private:
  void refuse(const char* what) const {
    itkExceptionMacro(
        << what << " has no meaning for palpate: leave it out; SetPreset() chooses the effort");
  }
  void check(PalResult result) {
    check(result, result == PAL_OK ? "" : pal_last_error());
  }
  void check(PalResult result, const std::string& sentence) {
    if (result == PAL_OK) return;
    if (result == PAL_DEVICE_FAILED) pal_context_close(&context_);  // the next Update() opens it
    itkExceptionMacro(<< sentence);
  }

  void open_context() {
    check(pal_context_close(&context_));
    PalContextInfo info{};
    info.size = sizeof info;
    info.version = PAL_VERSION;
    info.device = m_Device.empty() ? nullptr : m_Device.c_str();
    check(pal_context_open(&info, &context_));
    open_device_ = m_Device;
  }

  /// Of the image's buffer, which need not begin at index 0.
  static PalGrid grid_of(const TFixedImage& image) {
    PalGrid grid{};
    const auto& region = image.GetBufferedRegion();
    typename TFixedImage::PointType origin;
    image.TransformIndexToPhysicalPoint(region.GetIndex(), origin);
    for (unsigned a = 0; a < 3; ++a) {
      grid.size[a] = uint32_t(region.GetSize(a));
      grid.spacing_mm[a] = image.GetSpacing()[a];
      grid.origin_mm[a] = origin[a];
      for (unsigned row = 0; row < 3; ++row)
        grid.direction[3 * row + a] = image.GetDirection()(row, a);
    }
    return grid;
  }

  /// Whether an image has the same samples at the same places, to a thousandth of a voxel.
  template <class Image>
  static bool lies_on(const Image& image, const TFixedImage& fixed) {
    const auto& region = fixed.GetBufferedRegion();
    if (image.GetBufferedRegion() != region) return false;
    for (unsigned corner = 0; corner < 8; ++corner) {
      typename TFixedImage::IndexType index = region.GetIndex();
      for (unsigned a = 0; a < 3; ++a)
        if (corner >> a & 1U) index[a] += ::itk::IndexValueType(region.GetSize(a)) - 1;
      typename TFixedImage::PointType here, there;
      image.TransformIndexToPhysicalPoint(index, here);
      fixed.TransformIndexToPhysicalPoint(index, there);
      const auto& spacing = fixed.GetSpacing();
      if (here.EuclideanDistanceTo(there) > 1e-3 * std::min({spacing[0], spacing[1], spacing[2]}))
        return false;
    }
    return true;
  }

  const unsigned char* mask_on(const TFixedImage& fixed) const {
    const auto* const mask = this->GetMaskImage();
    if (!mask) return nullptr;
    if (!lies_on(*mask, fixed)) itkExceptionMacro("The mask is not on the grid of the fixed image");
    return mask->GetBufferPointer();
  }

  typename TMovingImage::ConstPointer moving_on(const TFixedImage& fixed) const {
    const typename TMovingImage::ConstPointer moving = this->GetMovingImage();
    if (lies_on(*moving, fixed)) return moving;
    const auto resampler = ::itk::ResampleImageFilter<TMovingImage, TMovingImage>::New();
    resampler->SetInput(moving);
    resampler->SetOutputParametersFromImage(&fixed);
    resampler->SetExtrapolator(
        ::itk::NearestNeighborExtrapolateImageFunction<TMovingImage, double>::New());
    resampler->Update();
    return resampler->GetOutput();
  }

  /// Waits on a thread of its own, so that observers are called on this one.
  void wait_for(PalEstimator* estimator, PalMotion*& motion, const std::atomic<double>& share) {
    const auto [result, sentence] = adapter::finish(
        estimator, motion, share,
        [this](double now) {
          ++m_ElapsedIterations;
          this->UpdateProgress(float(now));
          this->InvokeEvent(::itk::IterationEvent());
        },
        [this] { return stop_ || this->GetAbortGenerateData(); });
    if (result == PAL_CANCELLED) {
      this->ResetPipeline();
      ::itk::ProcessAborted aborted(__FILE__, __LINE__);
      aborted.SetDescription(sentence);
      throw aborted;
    }
    check(result, sentence);
  }

  void take(const PalMotion* motion, const TFixedImage& fixed, const TMovingImage& moving) {
    PalFieldInfo step{};
    step.size = sizeof step;
    this->AllocateOutputs();
    using Component = typename TDisplacementField::PixelType::ValueType;
    TDisplacementField* const field = this->GetOutput();
    const size_t samples = fixed.GetBufferedRegion().GetNumberOfPixels();
    if constexpr (std::is_same_v<Component, float>) {
      static_assert(sizeof(typename TDisplacementField::PixelType) == 3 * sizeof(float));
      check(pal_motion_field(motion, &step, field->GetBufferPointer()->GetDataPointer()));
    } else {
      std::vector<float> xyz(3 * samples);
      check(pal_motion_field(motion, &step, xyz.data()));
      for (size_t s = 0; s < samples; ++s)
        for (unsigned c = 0; c < 3; ++c)
          field->GetBufferPointer()[s][c] = Component(xyz[3 * s + c]);
    }
    confidence_ = ConfidenceImageType::New();
    confidence_->CopyInformation(&fixed);
    confidence_->SetRegions(fixed.GetBufferedRegion());
    confidence_->Allocate();
    check(pal_motion_confidence(motion, &step, confidence_->GetBufferPointer()));
    std::vector<float> warped(samples);
    check(pal_motion_warp(motion, &step, sample_type<typename TMovingImage::PixelType>(),
                          moving.GetBufferPointer(), warped.data()));
    double sum = 0.0;
    for (size_t s = 0; s < samples; ++s) {
      const double difference = double(fixed.GetBufferPointer()[s]) - double(warped[s]);
      sum += difference * difference;
    }
    metric_ = sum / double(samples);
    PalMotionSummary summary{};
    summary.size = sizeof summary;
    check(pal_motion_summary(motion, &summary));
    m_Verdict = summary.trust_word;
    m_Reasons = summary.reasons;
  }

  std::string m_Preset = "balanced";
  std::string m_Device;
  bool m_Check = true;
  ::itk::IdentifierType m_NumberOfIterations = 0;
  ::itk::IdentifierType m_ElapsedIterations = 0;
  std::string m_Verdict;
  std::string m_Reasons;
  ConfidenceImageType::Pointer confidence_;
  double metric_ = 0.0;
  std::atomic<bool> stop_{false};
  PalContext* context_ = nullptr;
  std::string open_device_;
};

}  // namespace palpate::itk
