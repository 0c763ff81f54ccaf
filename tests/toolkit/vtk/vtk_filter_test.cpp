// The VTK filters. Oracles: the C library's own fields and volumes, bit by bit; known shifts.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <vtkCallbackCommand.h>
#include <vtkExecutive.h>
#include <vtkSmartPointer.h>
#include <vtkTrivialProducer.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <thread>

#include "palpate_vtk.h"
#include "tests/files/temporary_folder.h"
#include "tests/toolkit/lost_device.h"

namespace palpate::test {
namespace {

using ::testing::HasSubstr;
using Image = vtkSmartPointer<vtkImageData>;
using Pipeline = vtkStreamingDemandDrivenPipeline;

constexpr double kTurned[9] = {0, -1, 0, 1, 0, 0, 0, 0, 1};

/// Waves whose material is shifted along the image's x by `shift` voxels of 2 mm. The image is
/// rotated in space, its x is the world's y, and its extent does not begin at 0.
Image waves(double shift, int size = 40, int type = VTK_SHORT, double level = 1000.0,
            double height = 200.0) {
  Image image = Image::New();
  image->SetExtent(3, 2 + size, -2, size + 1, 5, size);
  image->SetSpacing(2.0, 2.0, 3.0);
  image->SetOrigin(5.0, -7.0, 11.0);
  image->SetDirectionMatrix(kTurned);
  image->AllocateScalars(type, 1);
  vtkIdType n = 0;
  for (int z = 0; z < size - 4; ++z)
    for (int y = 0; y < size + 4; ++y)
      for (int x = 0; x < size; ++x) {
        const double at = x - shift;
        image->GetPointData()->GetScalars()->SetTuple1(
            n++,
            std::floor(level + height * (std::sin(at / 3) + std::sin(y / 4.0) +
                                         std::sin(z / 3.5 + at / 9) + std::sin((at + y) / 5))));
      }
  return image;
}

/// Six frames of waves that move back and forth along the image's x, by 3 voxels at most.
std::vector<Image> cycle_of_waves() {
  std::vector<Image> frames;
  for (int k = 0; k < 6; ++k) frames.push_back(waves(1.5 - 1.5 * std::cos(k * M_PI / 3.0)));
  return frames;
}

/// The grid of an image, from the positions that VTK itself gives for its voxels.
PalGrid grid_of(vtkImageData* image) {
  PalGrid grid{};
  int extent[6];
  image->GetExtent(extent);
  image->TransformIndexToPhysicalPoint(extent[0], extent[2], extent[4], grid.origin_mm);
  for (int a = 0; a < 3; ++a) {
    int next[3] = {extent[0], extent[2], extent[4]};
    ++next[a];
    double there[3];
    image->TransformIndexToPhysicalPoint(next, there);
    grid.size[a] = uint32_t(image->GetDimensions()[a]);
    grid.spacing_mm[a] = image->GetSpacing()[a];
    for (int row = 0; row < 3; ++row)
      grid.direction[3 * row + a] = (there[row] - grid.origin_mm[row]) / grid.spacing_mm[a];
  }
  return grid;
}

bool lies_on(vtkImageData* image, vtkImageData* other) {
  const PalGrid one = grid_of(image), two = grid_of(other);
  return std::memcmp(&one, &two, sizeof one) == 0 &&
         std::equal(image->GetExtent(), image->GetExtent() + 6, other->GetExtent());
}

/// The mean of value(voxel) over the voxels at least 8 from each side.
template <class Value>
double mean_inside(vtkImageData* image, const Value& value) {
  int size[3];
  image->GetDimensions(size);
  double sum = 0.0;
  size_t count = 0;
  for (int z = 8; z < size[2] - 8; ++z)
    for (int y = 8; y < size[1] - 8; ++y)
      for (int x = 8; x < size[0] - 8; ++x, ++count)
        sum += value(x + vtkIdType(size[0]) * (y + vtkIdType(size[1]) * z));
  return sum / double(count);
}

double mean_difference(vtkImageData* one, vtkImageData* other) {
  return mean_inside(one, [&](vtkIdType n) {
    return std::abs(one->GetPointData()->GetScalars()->GetTuple1(n) -
                    other->GetPointData()->GetScalars()->GetTuple1(n));
  });
}

bool same_values(vtkDataArray* array, const std::vector<float>& values) {
  return array && size_t(array->GetNumberOfValues()) == values.size() &&
         array->GetDataType() == VTK_FLOAT &&
         std::memcmp(array->GetVoidPointer(0), values.data(), values.size() * sizeof(float)) == 0;
}

/// Progress and errors that a filter reports during this object's life.
struct Heard {
  explicit Heard(vtkAlgorithm* of) : filter(of) {
    command->SetClientData(this);
    command->SetCallback([](vtkObject*, unsigned long event, void* mine, void* data) {
      auto& heard = *static_cast<Heard*>(mine);
      if (event == vtkCommand::ErrorEvent) heard.errors += static_cast<const char*>(data);
      if (event != vtkCommand::ProgressEvent) return;
      EXPECT_EQ(std::this_thread::get_id(), heard.here);
      const double share = *static_cast<double*>(data);
      if (share > 0.0 && share < 1.0) ++heard.working;
      if (heard.on_progress) heard.on_progress();
    });
    filter->AddObserver(vtkCommand::ErrorEvent, command);
    filter->AddObserver(vtkCommand::ProgressEvent, command);
    filter->GetExecutive()->AddObserver(vtkCommand::ErrorEvent, command);
  }
  Heard(const Heard&) = delete;
  Heard& operator=(const Heard&) = delete;
  ~Heard() {
    filter->RemoveObserver(command);
    filter->GetExecutive()->RemoveObserver(command);
  }
  vtkSmartPointer<vtkAlgorithm> filter;
  vtkNew<vtkCallbackCommand> command;
  std::thread::id here = std::this_thread::get_id();
  std::string errors;
  /// Progress reports that are neither the begin nor the end.
  int working = 0;
  std::function<void()> on_progress;
};

class VtkFilter : public ::testing::Test {
 protected:
  void SetUp() override {
    PalContextInfo info{};
    info.size = sizeof info;
    info.version = PAL_VERSION;
    if (pal_context_open(&info, &context_) != PAL_OK) GTEST_SKIP() << pal_last_error();
  }
  void TearDown() override { pal_context_close(&context_); }

  static vtkNew<vtkPalpateMotion> motion(vtkImageData* fixed, vtkImageData* moving) {
    vtkNew<vtkPalpateMotion> motion;
    motion->SetInputData(0, fixed);
    motion->SetInputData(1, moving);
    motion->SetPreset("fast");
    return motion;
  }
  static vtkNew<vtkPalpateSequence> sequence(const std::vector<Image>& frames) {
    vtkNew<vtkPalpateSequence> sequence;
    for (const Image& frame : frames) {
      vtkNew<vtkTrivialProducer> producer;
      producer->SetOutput(frame);
      sequence->AddInputConnection(producer->GetOutputPort());
    }
    sequence->SetPreset("fast");
    sequence->CyclicOn();
    sequence->CheckOff();
    return sequence;
  }

  /// The motion of the same images by the library itself; `step_s` is the time between two of them.
  PalMotion* own_motion(const std::vector<Image>& images, uint32_t flags, double step_s = 1.0) {
    PalEstimatorInfo info{};
    info.size = sizeof info;
    info.flags = flags | PAL_ESTIMATOR_NO_VERDICT;
    info.preset = "fast";
    info.grid = grid_of(images.front());
    PalEstimator* estimator = nullptr;
    PalMotion* found = nullptr;
    EXPECT_EQ(pal_estimator_open(context_, &info, &estimator), PAL_OK) << pal_last_error();
    double time_s = 0.0;
    for (const auto& image : images) {
      EXPECT_EQ(pal_estimator_push(estimator, PAL_INT16, image->GetScalarPointer(), time_s),
                PAL_OK);
      time_s += step_s;
    }
    EXPECT_EQ(pal_estimator_finish(estimator, &found), PAL_OK) << pal_last_error();
    pal_estimator_close(&estimator);
    return found;
  }
  static PalMotionSummary summary_of(const PalMotion* of) {
    PalMotionSummary summary{};
    summary.size = sizeof summary;
    EXPECT_EQ(pal_motion_summary(of, &summary), PAL_OK);
    return summary;
  }

  PalContext* context_ = nullptr;
  const Image fixed_ = waves(0.0), moving_ = waves(1.5);
};

TEST_F(VtkFilter, GivesTheLibrarysFieldOnTheFixedImagesGrid) {
  const auto found = motion(fixed_, moving_);
  found->Update();
  vtkImageData* const output = found->GetOutput();
  EXPECT_STREQ(found->GetError(), "");
  EXPECT_TRUE(lies_on(output, fixed_));
  vtkDataArray* const u = output->GetPointData()->GetScalars();
  ASSERT_TRUE(u);
  EXPECT_STREQ(u->GetName(), "displacement");
  EXPECT_EQ(output->GetPointData()->GetVectors(), u);

  PalMotion* own = own_motion({fixed_, moving_}, 0);
  PalFieldInfo step{};
  step.size = sizeof step;
  const auto samples = size_t(fixed_->GetNumberOfPoints());
  std::vector<float> xyz(3 * samples), confidence(samples), deviation(2 * samples);
  EXPECT_EQ(pal_motion_field(own, &step, xyz.data()), PAL_OK);
  EXPECT_EQ(pal_motion_confidence(own, &step, confidence.data()), PAL_OK);
  EXPECT_EQ(pal_motion_deviation(own, &step, deviation.data()), PAL_OK);
  pal_motion_close(&own);
  EXPECT_TRUE(same_values(u, xyz));
  EXPECT_TRUE(same_values(output->GetPointData()->GetArray("confidence"), confidence));
  EXPECT_TRUE(same_values(output->GetPointData()->GetArray("deviation"), deviation));

  // 1.5 voxels of 2 mm along the image's x, which is the world's y.
  const double along[3] = {0.0, 3.0, 0.0};
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(mean_inside(output, [&](vtkIdType n) { return u->GetComponent(n, c); }), along[c],
                0.3);
  EXPECT_STREQ(found->GetVerdict(), "ok");
}

TEST_F(VtkFilter, PromisesInThePipelineWhatItGives) {
  const auto found = motion(fixed_, moving_);
  found->UpdateInformation();
  vtkInformation* const info = found->GetOutputInformation(0);
  EXPECT_TRUE(std::equal(kTurned, kTurned + 9, info->Get(vtkDataObject::DIRECTION())));
  EXPECT_TRUE(std::equal(fixed_->GetExtent(), fixed_->GetExtent() + 6,
                         info->Get(Pipeline::WHOLE_EXTENT())));
  EXPECT_EQ(vtkImageData::GetScalarType(info), VTK_FLOAT);
  EXPECT_EQ(vtkImageData::GetNumberOfScalarComponents(info), 3);
  // A request for a part gives the whole field, computed once.
  const Heard heard(found);
  const int part[6] = {5, 9, 0, 4, 8, 8}, other[6] = {20, 24, 0, 4, 8, 8};
  EXPECT_TRUE(found->UpdateExtent(part));
  EXPECT_TRUE(lies_on(found->GetOutput(), fixed_));
  const vtkMTimeType first = found->GetOutput()->GetMTime();
  EXPECT_TRUE(found->UpdateExtent(other));
  EXPECT_EQ(found->GetOutput()->GetMTime(), first);
}

TEST_F(VtkFilter, ReadsTheSameFromEveryTypeAndExtent) {
  const auto whole = motion(fixed_, moving_);
  whole->CheckOff();
  whole->Update();
  const auto field_of = [](vtkPalpateMotion* filter) {
    const auto* const u = static_cast<const float*>(filter->GetOutput()->GetScalarPointer());
    return std::vector<float>(u, u + 3 * filter->GetOutput()->GetNumberOfPoints());
  };
  const std::vector<float> same = field_of(whole);
  struct Range {
    double level, height;
    std::vector<int> types;
  };
  for (const Range& range :
       {Range{
            1000.0, 200.0, {VTK_FLOAT, VTK_DOUBLE, VTK_INT, VTK_UNSIGNED_INT, VTK_UNSIGNED_SHORT}},
        Range{0.0, 20.0, {VTK_CHAR, VTK_SIGNED_CHAR}}, Range{100.0, 20.0, {VTK_UNSIGNED_CHAR}}}) {
    const auto of_type = [&](int type) {
      const auto found = motion(waves(0.0, 40, type, range.level, range.height),
                                waves(1.5, 40, type, range.level, range.height));
      found->CheckOff();
      EXPECT_EQ(found->GetExecutive()->Update(), 1) << type;
      return field_of(found);
    };
    const std::vector<float> of_short = of_type(VTK_SHORT);
    for (const int type : range.types) EXPECT_EQ(of_type(type), of_short) << type;
  }
  // The same places, with indices from 0.
  Image from_0 = Image::New();
  from_0->DeepCopy(moving_);
  double first[3];
  moving_->TransformIndexToPhysicalPoint(3, -2, 5, first);
  from_0->SetExtent(0, 39, 0, 43, 0, 35);
  from_0->SetOrigin(first);
  const auto found = motion(fixed_, from_0);
  found->CheckOff();
  found->Update();
  EXPECT_EQ(field_of(found), same);
  // A mask of half of the image.
  Image mask = Image::New();
  mask->CopyStructure(fixed_);
  mask->AllocateScalars(VTK_UNSIGNED_CHAR, 1);
  auto* const marks = static_cast<unsigned char*>(mask->GetScalarPointer());
  for (vtkIdType n = 0; n < mask->GetNumberOfPoints(); ++n) marks[n] = n % 40 < 20;
  whole->SetInputData(2, mask);
  whole->Update();
  EXPECT_NE(field_of(whole), same);
}

TEST_F(VtkFilter, TellsProgressOnItsThreadAndIsStopped) {
  const auto found = motion(waves(0.0, 72), waves(1.5, 72));
  found->SetPreset("best");
  Heard heard(found);
  heard.on_progress = [&] { found->AbortExecuteOn(); };
  EXPECT_EQ(found->GetExecutive()->Update(), 0);
  EXPECT_THAT(found->GetError(), HasSubstr("stopped"));
  EXPECT_EQ(found->GetOutput()->GetNumberOfPoints(), 0);
  // Again, with the fast preset.
  heard.on_progress = nullptr;
  found->AbortExecuteOff();
  found->SetPreset("fast");
  found->SetInputData(0, fixed_);
  found->SetInputData(1, moving_);
  EXPECT_NE(found->GetExecutive()->Update(), 0);
  EXPECT_STREQ(found->GetError(), "");
  EXPECT_EQ(found->GetOutput()->GetNumberOfPoints(), fixed_->GetNumberOfPoints());
}

TEST_F(VtkFilter, OpensALostDeviceAnewForAllThatShareIt) {
  const auto one = motion(fixed_, moving_), other = motion(fixed_, moving_);
  EXPECT_EQ(one->GetExecutive()->Update(), 1);
  EXPECT_EQ(other->GetExecutive()->Update(), 1);
  lose_vulkan_device();
  one->Modified();
  const Heard heard(one);
  EXPECT_EQ(one->GetExecutive()->Update(), 0);
  EXPECT_THAT(one->GetError(), HasSubstr("lost"));
  // The other filter has not used the lost device yet; it works on the new one too.
  for (const auto& filter : {one.Get(), other.Get()}) {
    filter->Modified();
    EXPECT_EQ(filter->GetExecutive()->Update(), 1) << filter->GetError();
    EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), fixed_->GetNumberOfPoints());
  }
}

TEST_F(VtkFilter, MotionRefusesInASentence) {
  const auto refused = [](vtkPalpateMotion* filter) {
    const Heard heard(filter);
    EXPECT_EQ(filter->GetExecutive()->Update(), 0);
    EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 0);
    return heard.errors;
  };
  Image other = Image::New();
  other->DeepCopy(moving_);
  other->SetOrigin(5.0, -7.0, 11.5);
  EXPECT_THAT(refused(motion(fixed_, other)), HasSubstr("not on the grid of the fixed one"));
  other->DeepCopy(moving_);
  other->SetDirectionMatrix(1, 0, 0, 0, 1, 0, 0, 0, 1);
  EXPECT_THAT(refused(motion(fixed_, other)), HasSubstr("not on the grid of the fixed one"));
  other->DeepCopy(moving_);
  other->AllocateScalars(VTK_LONG_LONG, 1);
  EXPECT_THAT(refused(motion(fixed_, other)), HasSubstr("The moving image has scalars of type"));
  other->AllocateScalars(VTK_SHORT, 3);
  EXPECT_THAT(refused(motion(other, moving_)), HasSubstr("The fixed image has 3 values per voxel"));
  other->GetPointData()->Initialize();
  EXPECT_THAT(refused(motion(other, moving_)), HasSubstr("The fixed image has no scalars"));
  const auto masked = motion(fixed_, moving_);
  masked->SetInputData(2, fixed_);
  EXPECT_THAT(refused(masked), HasSubstr("unsigned char"));
  vtkNew<vtkPalpateMotion> alone;
  alone->SetInputData(0, fixed_);
  EXPECT_THAT(refused(alone), HasSubstr("Input port 1"));
  const auto wrong = motion(fixed_, moving_);
  wrong->SetPreset("slow");
  EXPECT_THAT(refused(wrong), HasSubstr("preset"));
  wrong->SetPreset("fast");
  wrong->SetDevice("no-such-gpu");
  EXPECT_THAT(refused(wrong), HasSubstr("no-such-gpu"));
  wrong->SetDevice("");
  EXPECT_EQ(wrong->GetExecutive()->Update(), 1);
}

TEST_F(VtkFilter, CarriesTheReferenceFrameToEveryTimeAndEstimatesOnce) {
  const std::vector<Image> frames = cycle_of_waves();
  const auto moved = sequence(frames);
  moved->SetCycle(0.9);
  Heard heard(moved);
  ASSERT_NE(moved->GetExecutive()->Update(), 0) << heard.errors;
  EXPECT_GT(heard.working, 0);
  const int reference = moved->GetReferenceFrame();
  ASSERT_GE(reference, 0);
  EXPECT_TRUE(lies_on(moved->GetOutput(), frames[0]));
  heard.working = 0;

  PalMotion* own = own_motion(frames, PAL_ESTIMATOR_CYCLIC, 0.9 / 6);
  EXPECT_EQ(summary_of(own).reference_frame, uint32_t(reference));
  std::vector<float> values(size_t(frames[0]->GetNumberOfPoints()));
  for (size_t k = 0; k < frames.size(); ++k) {
    moved->SetPhase(double(k) / 6.0);
    moved->Update();
    EXPECT_NEAR(moved->GetOutputTime(), 0.15 * double(k), 1e-9);
    PalFieldInfo then{};
    then.size = sizeof then;
    then.flags = PAL_FIELD_TO_TIME | PAL_FIELD_INVERSE;
    then.time_s = moved->GetOutputTime();
    ASSERT_EQ(pal_motion_warp(own, &then, PAL_INT16, frames[size_t(reference)]->GetScalarPointer(),
                              values.data()),
              PAL_OK);
    EXPECT_TRUE(same_values(moved->GetOutput()->GetPointData()->GetScalars(), values)) << k;
    const double still = mean_difference(frames[size_t(reference)], frames[k]);
    if (still > 20.0) {
      EXPECT_LT(mean_difference(moved->GetOutput(), frames[k]), 0.25 * still) << k;
    }
  }
  pal_motion_close(&own);
  // The motion is not estimated again.
  EXPECT_EQ(heard.working, 0);

  // One cycle later the image is the same.
  moved->SetTime(0.31);
  moved->Update();
  Image once = Image::New();
  once->DeepCopy(moved->GetOutput());
  moved->SetTime(0.31 + 0.9);
  moved->Update();
  EXPECT_LT(mean_difference(once, moved->GetOutput()), 1e-2);
  EXPECT_EQ(heard.working, 0);
  // A change of a frame needs a new estimation.
  frames[2]->Modified();
  moved->Update();
  EXPECT_GT(heard.working, 0);
  heard.working = 0;
  moved->SetCycle(1.8);
  moved->Update();
  EXPECT_GT(heard.working, 0);
}

TEST_F(VtkFilter, GivesThePipelineTheTimeThatItAsksFor) {
  const auto moved = sequence(cycle_of_waves());
  moved->CyclicOff();
  const double times[6] = {-1.0, 0.0, 0.5, 1.0, 2.0, 3.0};
  for (int k = 0; k < 6; ++k) moved->SetFrameTime(k, times[k]);
  moved->UpdateInformation();
  vtkInformation* const info = moved->GetOutputInformation(0);
  ASSERT_EQ(info->Length(Pipeline::TIME_STEPS()), 6);
  EXPECT_TRUE(std::equal(times, times + 6, info->Get(Pipeline::TIME_STEPS())));
  EXPECT_EQ(info->Get(Pipeline::TIME_RANGE())[0], -1.0);
  EXPECT_EQ(info->Get(Pipeline::TIME_RANGE())[1], 3.0);

  const auto shown = [&] {
    const auto* const values = static_cast<const float*>(moved->GetOutput()->GetScalarPointer());
    return std::vector<float>(values, values + moved->GetOutput()->GetNumberOfPoints());
  };
  moved->UpdateTimeStep(1.4);
  EXPECT_EQ(moved->GetOutputTime(), 1.4);
  EXPECT_EQ(moved->GetOutput()->GetInformation()->Get(vtkDataObject::DATA_TIME_STEP()), 1.4);
  const std::vector<float> asked = shown();
  moved->UpdateTimeStep(0.2);
  EXPECT_NE(shown(), asked);
  // The last setting counts.
  moved->SetPhase(0.6);
  moved->Update();
  EXPECT_NEAR(moved->GetOutputTime(), 1.4, 1e-12);
  EXPECT_EQ(shown(), asked);
  // After the end the last frame stays.
  moved->SetTime(3.0);
  moved->Update();
  const std::vector<float> end = shown();
  moved->SetTime(7.0);
  moved->Update();
  EXPECT_EQ(shown(), end);
}

TEST_F(VtkFilter, ReadsAMotionFile) {
  const std::vector<Image> frames = cycle_of_waves();
  const files::TemporaryFolder folder;
  const std::string path = folder / "motion.nrrd";
  PalMotion* own = own_motion(frames, PAL_ESTIMATOR_CYCLIC, 0.15);
  ASSERT_EQ(pal_motion_save(own, nullptr, path.c_str()), PAL_OK) << pal_last_error();
  const auto reference = size_t(summary_of(own).reference_frame);
  pal_motion_close(&own);

  const auto estimated = sequence(frames), read = sequence({frames[reference]}),
             of_all = sequence(frames);
  estimated->SetCycle(0.9);
  read->SetMotionFile(path.c_str());
  read->UpdateInformation();
  EXPECT_EQ(read->GetReferenceFrame(), int(reference));
  EXPECT_NEAR(read->GetOutputInformation(0)->Get(Pipeline::TIME_RANGE())[1], 0.9, 1e-6);
  of_all->SetMotionFile(path.c_str());
  Heard heard(read);
  for (auto* one : {estimated.Get(), read.Get(), of_all.Get()}) {
    one->SetPhase(0.3);
    ASSERT_EQ(one->GetExecutive()->Update(), 1) << one->GetError();
  }
  EXPECT_EQ(heard.working, 0);
  EXPECT_LT(mean_difference(estimated->GetOutput(), read->GetOutput()), 0.01);
  EXPECT_EQ(mean_difference(of_all->GetOutput(), read->GetOutput()), 0.0);

  const auto refused = [](vtkPalpateSequence* filter) {
    const Heard of(filter);
    EXPECT_EQ(filter->GetExecutive()->Update(), 0);
    return of.errors;
  };
  Image straight = Image::New();
  straight->DeepCopy(frames[reference]);
  straight->SetDirectionMatrix(1, 0, 0, 0, 1, 0, 0, 0, 1);
  const auto elsewhere = sequence({straight});
  elsewhere->SetMotionFile(path.c_str());
  EXPECT_THAT(refused(elsewhere), HasSubstr("does not lie where the motion file does"));
  const auto too_many = sequence({frames[0], frames[1]});
  too_many->SetMotionFile(path.c_str());
  EXPECT_THAT(refused(too_many), HasSubstr("6 frames, but 2 are connected"));
  read->SetMotionFile("/nowhere.nrrd");
  EXPECT_THAT(refused(read), HasSubstr("/nowhere.nrrd"));
}

TEST_F(VtkFilter, SequenceRefusesInASentence) {
  const auto refused = [](vtkPalpateSequence* filter) {
    const Heard heard(filter);
    EXPECT_EQ(filter->GetExecutive()->Update(), 0);
    EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 0);
    return heard.errors;
  };
  std::vector<Image> frames = cycle_of_waves();
  EXPECT_THAT(refused(sequence({frames[0], frames[1]})), HasSubstr("three frames or more"));
  const auto timed = sequence(frames);
  timed->SetFrameTime(1, 1.0);
  EXPECT_THAT(refused(timed), HasSubstr("6 frames, but times of 2"));
  for (int k = 0; k < 6; ++k) timed->SetFrameTime(k, k == 3 ? 1.0 : k);
  EXPECT_THAT(refused(timed), HasSubstr("must rise"));
  timed->ClearFrameTimes();
  EXPECT_EQ(timed->GetExecutive()->Update(), 1);
  frames[4]->SetSpacing(2.0, 2.0, 3.1);
  EXPECT_THAT(refused(sequence(frames)), HasSubstr("Frame 4 is not on the grid of frame 0"));
  Heard heard(timed);
  timed->SetPhase(std::nan(""));
  EXPECT_THAT(heard.errors, HasSubstr("must be a number"));
  vtkNew<vtkPalpateSequence> none;
  EXPECT_THAT(refused(none), HasSubstr("Input port 0"));
  // Stopped, and then not stopped.
  const auto stopped = sequence(cycle_of_waves());
  Heard of_it(stopped);
  of_it.on_progress = [&] { stopped->AbortExecuteOn(); };
  EXPECT_EQ(stopped->GetExecutive()->Update(), 0);
  EXPECT_EQ(stopped->GetReferenceFrame(), -1);
  of_it.on_progress = nullptr;
  stopped->AbortExecuteOff();
  EXPECT_EQ(stopped->GetExecutive()->Update(), 1);
}

}  // namespace
}  // namespace palpate::test
