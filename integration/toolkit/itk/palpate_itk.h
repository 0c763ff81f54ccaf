#pragma once

// palpate in ITK 5: a filter with the methods of itk::DemonsRegistrationFilter. Header only; link
// palpate::palpate and ITK.
#include <itkCommand.h>
#include <itkImage.h>
#include <itkImageToImageFilter.h>
#include <itkLinearInterpolateImageFunction.h>
#include <itkNearestNeighborExtrapolateImageFunction.h>
#include <itkResampleImageFilter.h>
#include <itkVector.h>
#include <palpate_adapter.h>

#include <algorithm>
#include <atomic>
#include <string>
#include <type_traits>
#include <vector>

namespace palpate::itk {

/// The PalSampleType of a pixel type. A type that palpate does not read is a compile error.
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

/// Estimates the displacement field between two 3D images, on a Vulkan device. A replacement for
/// itk::DemonsRegistrationFilter with the same methods and the same output: mm along L, P, S on the
/// fixed image's grid. The material at x of the fixed image is at x + u(x) in the moving one. The
/// output is a valid input of itk::WarpImageFilter and itk::DisplacementFieldTransform.
///
///   using Filter = palpate::itk::MotionFilter<Image, Image, Field>;
///   auto filter = Filter::New();
///   filter->SetFixedImage(fixed);
///   filter->SetMovingImage(moving);
///   filter->Update();
///   Field* field = filter->GetDisplacementField();
///
/// Inputs: the filter requests whole images, it does not stream. A moving image on another grid is
/// resampled onto the fixed image's grid (linear, border values clamped). No histogram matching or
/// smoothing is needed before.
///
/// Events: observers get itk::ProgressEvent and itk::IterationEvent on the thread that called
/// Update(). They may call StopRegistration() or AbortGenerateDataOn(); then Update() throws
/// itk::ProcessAborted and gives no field.
///
/// Errors: itk::ExceptionObject with one sentence, also from a method of the Demons filter that has
/// no meaning for palpate. After the Vulkan device was lost, the next Update() opens it again.
///
/// Threads: one at a time, as with every ITK filter.
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
  using DeviationImageType = ::itk::Image<::itk::Vector<float, 2>, 3>;
  using StandardDeviationsType = ::itk::FixedArray<double, 3>;

  itkSetInputMacro(FixedImage, FixedImageType);
  itkGetInputMacro(FixedImage, FixedImageType);
  itkSetInputMacro(MovingImage, MovingImageType);
  itkGetInputMacro(MovingImage, MovingImageType);
  /// Optional, on the fixed image's grid: where it is 0 the images are ignored. Draw it 10 voxels
  /// wider than the part that you need.
  itkSetInputMacro(MaskImage, MaskImageType);
  itkGetInputMacro(MaskImage, MaskImageType);
  /// After Update(): the field, mm. The same as GetOutput().
  TDisplacementField* GetDisplacementField() {
    return this->GetOutput();
  }

  /// The effort: "fast", "balanced" (default), "best" or "classic".
  itkSetStringMacro(Preset);
  itkGetStringMacro(Preset);
  /// The Vulkan device, by number or part of its name; "" (default): the first GPU, else the CPU.
  itkSetStringMacro(Device);
  itkGetStringMacro(Device);
  /// Whether the field is compared with the images after the estimation, see GetVerdict(). Default:
  /// on. Off saves time.
  itkSetMacro(Check, bool);
  itkGetConstMacro(Check, bool);
  itkBooleanMacro(Check);
  /// The largest number of iterations on each level of the pyramid; 0 (default): that of the
  /// preset.
  itkSetMacro(NumberOfIterations, ::itk::IdentifierType);
  itkGetConstMacro(NumberOfIterations, ::itk::IdentifierType);
  /// The number of itk::IterationEvent sent by the present or last Update().
  itkGetConstMacro(ElapsedIterations, ::itk::IdentifierType);

  /// Cancels Update(), which then throws itk::ProcessAborted. Any thread.
  virtual void StopRegistration() {
    stop_ = true;
  }

  /// After Update(): "ok", "suspect" or "failed"; "" if the field was not checked.
  itkGetStringMacro(Verdict);
  /// After Update(): why the verdict is not ok, one sentence per line.
  itkGetStringMacro(Reasons);
  /// After Update(): the confidence of each vector, 0 to 1, on the fixed image's grid. It is the
  /// share of similar vectors that are right within half a voxel.
  ConfidenceImageType* GetConfidence() {
    return confidence_;
  }
  /// After Update(): the standard deviation of the error of each vector, mm, on the fixed image's
  /// grid: along the image gradient, where the images show motion best, and across it, in each of
  /// the two other directions.
  DeviationImageType* GetDeviation() {
    return deviation_;
  }
  /// After Update(): the mean squared difference between the fixed image and the moving image
  /// warped by the field, over the whole fixed image.
  double GetMetric() const {
    return metric_;
  }

  // Methods of the Demons filter that have no meaning for palpate. They throw itk::ExceptionObject.
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
  /// The spacing is always used; switching it off throws.
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

  /// Does nothing: the images may be on different grids.
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
    // The estimator's callback writes to it: it must outlive the estimator.
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
    // After a lost device the next Update() opens it again.
    if (result == PAL_DEVICE_FAILED) pal_context_close(&context_);
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

  /// The grid of the image's buffer, which need not begin at index 0.
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

  /// True if the image has the same region as the fixed one, and its corners lie at the same places
  /// to a thousandth of the finest voxel edge.
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

  /// The samples of the mask, or null without a mask. Throws if it is on another grid.
  const unsigned char* mask_on(const TFixedImage& fixed) const {
    const auto* const mask = this->GetMaskImage();
    if (!mask) return nullptr;
    if (!lies_on(*mask, fixed)) itkExceptionMacro("The mask is not on the grid of the fixed image");
    return mask->GetBufferPointer();
  }

  /// The moving image on the fixed image's grid, resampled if necessary.
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

  /// Waits for the motion; another thread estimates, so that observers are called on this one.
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

  /// An image on the grid of another one, with its samples allocated.
  template <class Image>
  static typename Image::Pointer image_like(const TFixedImage& other) {
    auto image = Image::New();
    image->CopyInformation(&other);
    image->SetRegions(other.GetBufferedRegion());
    image->Allocate();
    return image;
  }

  /// Copies field, confidence, deviation, metric and verdict from the motion.
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
    confidence_ = image_like<ConfidenceImageType>(fixed);
    check(pal_motion_confidence(motion, &step, confidence_->GetBufferPointer()));
    deviation_ = image_like<DeviationImageType>(fixed);
    static_assert(sizeof(typename DeviationImageType::PixelType) == 2 * sizeof(float));
    check(pal_motion_deviation(motion, &step, deviation_->GetBufferPointer()->GetDataPointer()));
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
  DeviationImageType::Pointer deviation_;
  double metric_ = 0.0;
  std::atomic<bool> stop_{false};
  PalContext* context_ = nullptr;
  std::string open_device_;
};

}  // namespace palpate::itk
