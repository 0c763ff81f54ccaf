// The ITK filter. Oracles: the C library's own field, bit by bit; itk::WarpImageFilter.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <itkImageAlgorithm.h>
#include <itkImageRegionConstIterator.h>
#include <itkImageRegionIterator.h>
#include <itkVector.h>
#include <itkWarpImageFilter.h>

#include <cmath>
#include <cstring>
#include <thread>

#include "palpate_itk.h"
#include "tests/toolkit/lost_device.h"

namespace palpate::test {
namespace {

using ::testing::HasSubstr;
using Image = ::itk::Image<short, 3>;
using Field = ::itk::Image<::itk::Vector<float, 3>, 3>;
using Filter = palpate::itk::MotionFilter<Image, Image, Field>;

/// Waves whose material is shifted along the image's x by `shift` voxels. The image is rotated in
/// space, its x is the patient's P, and its first index is not 0.
Image::Pointer waves(double shift, int size = 40) {
  auto image = Image::New();
  Image::RegionType region;
  region.SetIndex({{3, -2, 5}});
  region.SetSize({{size_t(size), size_t(size) + 4, size_t(size) - 4}});
  image->SetRegions(region);
  const double spacing[3] = {2.0, 2.0, 3.0}, origin[3] = {5.0, -7.0, 11.0};
  image->SetSpacing(spacing);
  image->SetOrigin(origin);
  Image::DirectionType turned;
  turned.Fill(0.0);
  turned(1, 0) = 1.0;
  turned(0, 1) = -1.0;
  turned(2, 2) = 1.0;
  image->SetDirection(turned);
  image->Allocate();
  short* to = image->GetBufferPointer();
  for (int z = 0; z < size - 4; ++z)
    for (int y = 0; y < size + 4; ++y)
      for (int x = 0; x < size; ++x) {
        const double at = x - shift;
        *to++ = short(1000.0 + 200.0 * (std::sin(at / 3) + std::sin(y / 4.0) +
                                        std::sin(z / 3.5 + at / 9) + std::sin((at + y) / 5)));
      }
  return image;
}

bool is_inside(const Image& image, const Image::IndexType& index) {
  for (unsigned a = 0; a < 3; ++a) {
    const auto begin = image.GetBufferedRegion().GetIndex(a);
    const auto size = ::itk::IndexValueType(image.GetBufferedRegion().GetSize(a));
    if (index[a] < begin + 8 || index[a] >= begin + size - 8) return false;
  }
  return true;
}

double mean_difference(const Image& a, const Image& b) {
  double sum = 0.0;
  size_t count = 0;
  ::itk::ImageRegionConstIterator<Image> one(&a, a.GetBufferedRegion()),
      other(&b, a.GetBufferedRegion());
  for (; !one.IsAtEnd(); ++one, ++other) {
    if (!is_inside(a, one.GetIndex())) continue;
    sum += std::abs(double(one.Get()) - double(other.Get()));
    ++count;
  }
  return sum / double(count);
}

class ItkFilter : public ::testing::Test {
 protected:
  void SetUp() override {
    PalContextInfo info{};
    info.size = sizeof info;
    info.version = PAL_VERSION;
    if (pal_context_open(&info, &context_) != PAL_OK) GTEST_SKIP() << pal_last_error();
  }
  void TearDown() override { pal_context_close(&context_); }

  static Filter::Pointer filter(Image* fixed, Image* moving) {
    auto filter = Filter::New();
    filter->SetFixedImage(fixed);
    filter->SetMovingImage(moving);
    filter->SetPreset("fast");
    return filter;
  }

  PalContext* context_ = nullptr;
  const Image::Pointer fixed_ = waves(0.0), moving_ = waves(1.5);
};

TEST_F(ItkFilter, GivesTheLibrarysFieldAndItkWarpsWithIt) {
  const auto found = filter(fixed_, moving_);
  found->Update();
  const Field* const field = found->GetDisplacementField();
  EXPECT_EQ(field->GetBufferedRegion(), fixed_->GetBufferedRegion());
  EXPECT_EQ(field->GetOrigin(), fixed_->GetOrigin());
  EXPECT_EQ(field->GetDirection(), fixed_->GetDirection());

  PalEstimatorInfo info{};
  info.size = sizeof info;
  info.preset = "fast";
  Image::PointType origin;
  fixed_->TransformIndexToPhysicalPoint(fixed_->GetBufferedRegion().GetIndex(), origin);
  for (unsigned a = 0; a < 3; ++a) {
    info.grid.size[a] = uint32_t(fixed_->GetBufferedRegion().GetSize(a));
    info.grid.spacing_mm[a] = fixed_->GetSpacing()[a];
    info.grid.origin_mm[a] = origin[a];
    for (unsigned row = 0; row < 3; ++row)
      info.grid.direction[3 * row + a] = fixed_->GetDirection()(row, a);
  }
  PalEstimator* estimator = nullptr;
  PalMotion* motion = nullptr;
  ASSERT_EQ(pal_estimator_open(context_, &info, &estimator), PAL_OK) << pal_last_error();
  for (const auto& image : {fixed_, moving_})
    ASSERT_EQ(pal_estimator_push(estimator, PAL_INT16, image->GetBufferPointer(), -1.0), PAL_OK);
  ASSERT_EQ(pal_estimator_finish(estimator, &motion), PAL_OK) << pal_last_error();
  PalFieldInfo step{};
  step.size = sizeof step;
  const size_t samples = fixed_->GetBufferedRegion().GetNumberOfPixels();
  std::vector<float> xyz(3 * samples), confidence(samples), deviation(2 * samples);
  EXPECT_EQ(pal_motion_field(motion, &step, xyz.data()), PAL_OK);
  EXPECT_EQ(pal_motion_confidence(motion, &step, confidence.data()), PAL_OK);
  EXPECT_EQ(pal_motion_deviation(motion, &step, deviation.data()), PAL_OK);
  std::vector<float> warped(samples);
  EXPECT_EQ(pal_motion_warp(motion, &step, PAL_INT16, moving_->GetBufferPointer(), warped.data()),
            PAL_OK);
  double squares = 0.0;
  for (size_t s = 0; s < samples; ++s)
    squares += std::pow(double(fixed_->GetBufferPointer()[s]) - double(warped[s]), 2);
  EXPECT_NEAR(found->GetMetric(), squares / double(samples), 1e-6);
  pal_motion_close(&motion);
  pal_estimator_close(&estimator);
  const float* const same = field->GetBufferPointer()->GetDataPointer();
  EXPECT_TRUE(std::equal(xyz.begin(), xyz.end(), same));
  EXPECT_TRUE(
      std::equal(confidence.begin(), confidence.end(), found->GetConfidence()->GetBufferPointer()));
  const auto* const given = found->GetDeviation();
  EXPECT_EQ(given->GetDirection(), fixed_->GetDirection());
  EXPECT_TRUE(
      std::equal(deviation.begin(), deviation.end(), given->GetBufferPointer()->GetDataPointer()));

  // 1.5 voxels of 2 mm along the image's x, which is the patient's P.
  double sum[3] = {0.0, 0.0, 0.0};
  size_t count = 0;
  ::itk::ImageRegionConstIterator<Field> at(field, field->GetBufferedRegion());
  for (; !at.IsAtEnd(); ++at)
    if (is_inside(*fixed_, at.GetIndex())) {
      for (unsigned c = 0; c < 3; ++c) sum[c] += double(at.Get()[c]);
      ++count;
    }
  EXPECT_NEAR(sum[0] / double(count), 0.0, 0.3);
  EXPECT_NEAR(sum[1] / double(count), 3.0, 0.3);
  EXPECT_NEAR(sum[2] / double(count), 0.0, 0.3);

  const auto warper = ::itk::WarpImageFilter<Image, Image, Field>::New();
  warper->SetInput(moving_);
  warper->SetDisplacementField(field);
  warper->SetOutputParametersFromImage(fixed_);
  warper->Update();
  EXPECT_LT(mean_difference(*fixed_, *warper->GetOutput()),
            0.15 * mean_difference(*fixed_, *moving_));
  EXPECT_STREQ(found->GetVerdict(), "ok");
}

TEST_F(ItkFilter, TakesAMovingImageOnAnotherGridAndDoublesOut) {
  // The same content, with two voxels more at each end of x.
  const auto wide = Image::New();
  auto region = moving_->GetLargestPossibleRegion();
  region.SetIndex(0, region.GetIndex(0) + 2);
  region.SetSize(0, region.GetSize(0) - 4);
  wide->SetRegions(region);
  wide->CopyInformation(moving_);
  wide->SetRegions(region);
  wide->Allocate();
  ::itk::ImageAlgorithm::Copy(moving_.GetPointer(), wide.GetPointer(), region, region);
  using Doubles = ::itk::Image<::itk::Vector<double, 3>, 3>;
  const auto found = palpate::itk::MotionFilter<Image, Image, Doubles>::New();
  found->SetFixedImage(fixed_);
  found->SetMovingImage(wide);
  found->SetPreset("fast");
  found->CheckOff();
  found->Update();
  EXPECT_STREQ(found->GetVerdict(), "");
  Image::IndexType middle = {{23, 18, 21}};
  EXPECT_NEAR(found->GetOutput()->GetPixel(middle)[1], 3.0, 0.5);
  EXPECT_EQ(found->GetOutput()->GetLargestPossibleRegion(), fixed_->GetLargestPossibleRegion());
}

TEST_F(ItkFilter, TellsProgressOnItsThreadAndIsStopped) {
  const auto found = filter(waves(0.0, 72), waves(1.5, 72));
  found->SetPreset("best");
  int events = 0;
  const auto here = std::this_thread::get_id();
  const auto observer = ::itk::CStyleCommand::New();
  struct Heard {
    Filter* filter;
    int* events;
    std::thread::id here;
  } heard{found, &events, here};
  observer->SetClientData(&heard);
  observer->SetCallback([](::itk::Object*, const ::itk::EventObject&, void* user) {
    auto& mine = *static_cast<Heard*>(user);
    EXPECT_EQ(std::this_thread::get_id(), mine.here);
    ++*mine.events;
    mine.filter->StopRegistration();
  });
  found->AddObserver(::itk::IterationEvent(), observer);
  EXPECT_THROW(found->Update(), ::itk::ProcessAborted);
  EXPECT_GE(events, 1);
  // Again, with the fast preset.
  found->RemoveAllObservers();
  found->SetPreset("fast");
  found->SetFixedImage(fixed_);
  found->SetMovingImage(moving_);
  EXPECT_NO_THROW(found->Update());
}

TEST_F(ItkFilter, HonoursMaskAndIterations) {
  const auto whole = filter(fixed_, moving_);
  whole->CheckOff();
  whole->Update();
  const auto differs = [&](Filter* other) {
    other->CheckOff();
    other->Update();
    return std::memcmp(whole->GetOutput()->GetBufferPointer(),
                       other->GetOutput()->GetBufferPointer(),
                       3 * sizeof(float) * fixed_->GetBufferedRegion().GetNumberOfPixels()) != 0;
  };
  const auto again = filter(fixed_, moving_);
  EXPECT_FALSE(differs(again));
  const auto one = filter(fixed_, moving_);
  one->SetNumberOfIterations(1);
  EXPECT_TRUE(differs(one));
  const auto mask = Filter::MaskImageType::New();
  mask->CopyInformation(fixed_);
  mask->SetRegions(fixed_->GetBufferedRegion());
  mask->Allocate(true);
  const auto masked = filter(fixed_, moving_);
  masked->SetMaskImage(mask);
  // The mask is empty.
  EXPECT_THROW(masked->Update(), ::itk::ExceptionObject);
  auto half = fixed_->GetBufferedRegion();
  half.SetSize(0, half.GetSize(0) / 2);
  for (::itk::ImageRegionIterator<Filter::MaskImageType> at(mask, half); !at.IsAtEnd(); ++at)
    at.Set(1);
  mask->Modified();
  EXPECT_TRUE(differs(masked));
}

TEST_F(ItkFilter, RefusesInASentence) {
  const auto found = filter(fixed_, moving_);
  const auto sentence = [](const auto& work) -> std::string {
    try {
      work();
    } catch (const ::itk::ExceptionObject& error) {
      return error.GetDescription();
    }
    return "";
  };
  EXPECT_THAT(sentence([&] { found->SetStandardDeviations(1.5); }),
              HasSubstr("StandardDeviations has no meaning"));
  EXPECT_THAT(sentence([&] { found->UseImageSpacingOff(); }), HasSubstr("UseImageSpacing"));
  EXPECT_EQ(sentence([&] { found->UseImageSpacingOn(); }), "");
  found->SetPreset("slow");
  EXPECT_THAT(sentence([&] { found->Update(); }), HasSubstr("preset"));
  found->SetPreset("fast");
  found->SetDevice("no-such-gpu");
  EXPECT_THAT(sentence([&] { found->Update(); }), HasSubstr("no-such-gpu"));
  EXPECT_THAT(sentence([&] { filter(fixed_, nullptr)->Update(); }), HasSubstr("MovingImage"));
}

TEST_F(ItkFilter, OpensALostDeviceAnew) {
  const auto found = filter(fixed_, moving_);
  found->Update();
  const double sound = found->GetMetric();
  lose_vulkan_device();
  found->Modified();
  try {
    found->Update();
    ADD_FAILURE() << "a lost device gives no field";
  } catch (const ::itk::ExceptionObject& error) {
    EXPECT_THAT(error.GetDescription(), HasSubstr("lost"));
  }
  found->Modified();
  EXPECT_NO_THROW(found->Update());
  EXPECT_EQ(found->GetMetric(), sound);
}

}  // namespace
}  // namespace palpate::test
