/* ITK's example of Demons registration with palpate's filter, compared with ITK's own Demons.

   cmake -S docs/examples -B examples && cmake --build examples
   examples/itk_demons fixed.nii.gz moving.nii.gz [truth.mha [mask.mha]] [--warped warped.nii.gz]
   [--field field.mha]

   Prints time and error of palpate and of two of ITK's filters. The error is the distance to the
   true displacement field (mm) at its samples; without a true field it is the difference between
   the fixed image and the moving image warped by the field. With a mask only samples where the mask
   is not 0 count. The written files are those of palpate's field.

   Three parts of ITK's example are not needed with palpate: the histogram matching before the
   registration, the number of iterations, and the standard deviations of the smoothing. The output
   is the same: a displacement field in mm on the fixed image's grid, an input of
   itk::WarpImageFilter. */
#include <itkDiffeomorphicDemonsRegistrationFilter.h>
#include <itkFastSymmetricForcesDemonsRegistrationFilter.h>
#include <itkImageFileReader.h>
#include <itkImageFileWriter.h>
#include <itkImageRegionConstIteratorWithIndex.h>
#include <itkMultiResolutionPDEDeformableRegistration.h>
#include <itkVectorLinearInterpolateImageFunction.h>
#include <itkWarpImageFilter.h>
#include <palpate_itk.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <vector>

using Image = itk::Image<float, 3>;
using Field = itk::Image<itk::Vector<float, 3>, 3>;
using Mask = itk::Image<unsigned char, 3>;
using Filter = palpate::itk::MotionFilter<Image, Image, Field>;

class Progress : public itk::Command {
 public:
  using Self = Progress;
  using Pointer = itk::SmartPointer<Self>;
  itkNewMacro(Self);

 protected:
  void Execute(itk::Object* caller, const itk::EventObject& event) override {
    Execute(static_cast<const itk::Object*>(caller), event);
  }
  void Execute(const itk::Object* caller, const itk::EventObject&) override {
    const auto* const filter = static_cast<const Filter*>(caller);
    std::cout << "\r" << int(100 * filter->GetProgress()) << " %  " << std::flush;
  }
};

/// Runs one of ITK's filters on a pyramid, with the settings that gave the smallest error on the
/// images of palpate's benchmarks. Returns a field in mm on the fixed image's grid.
template <class Demons>
Field::Pointer demons(const Image* fixed, const Image* moving) {
  const auto filter = Demons::New();
  filter->SetUseGradientType(itk::ESMDemonsRegistrationFunctionEnums::Gradient::WarpedMoving);
  filter->SetMaximumUpdateStepLength(0.5);  // voxels
  filter->SetStandardDeviations(2.0);       // voxels
  const auto pyramid = itk::MultiResolutionPDEDeformableRegistration<Image, Image, Field>::New();
  pyramid->SetRegistrationFilter(filter);
  pyramid->SetNumberOfLevels(4);
  const unsigned iterations[] = {50, 50, 30, 20};  // from coarse to fine
  pyramid->SetNumberOfIterations(itk::Array<unsigned>(iterations, 4));
  pyramid->SetFixedImage(fixed);
  pyramid->SetMovingImage(moving);
  pyramid->Update();
  return pyramid->GetOutput();
}

Image::Pointer warped(const Image* fixed, const Image* moving, const Field* field) {
  const auto warper = itk::WarpImageFilter<Image, Image, Field>::New();
  warper->SetInput(moving);
  warper->SetDisplacementField(field);
  warper->SetOutputParametersFromImage(fixed);
  warper->Update();
  return warper->GetOutput();
}

/// The error at each sample of the truth (mm) that lies in the mask; at each sample of the fixed
/// image (difference of values) if `truth` is null. A null field means no motion.
std::vector<double> errors(const Image* fixed, const Image* moving, const Field* field,
                           const Field* truth, const Mask* mask) {
  std::vector<double> all;
  const auto counts = [mask](const itk::Point<double, 3>& place) {
    Mask::IndexType index;
    return !mask ||
           (mask->TransformPhysicalPointToIndex(place, index) && mask->GetPixel(index) != 0);
  };
  if (truth) {
    const auto found = itk::VectorLinearInterpolateImageFunction<Field, double>::New();
    if (field) found->SetInputImage(field);
    for (itk::ImageRegionConstIteratorWithIndex<Field> at(truth, truth->GetBufferedRegion());
         !at.IsAtEnd(); ++at) {
      Field::PointType place;
      truth->TransformIndexToPhysicalPoint(at.GetIndex(), place);
      if (!counts(place) || (field && !found->IsInsideBuffer(place))) continue;
      itk::Vector<double, 3> wrong(at.Get());
      if (field) wrong -= found->Evaluate(place);
      all.push_back(wrong.GetNorm());
    }
  } else {
    const Image::ConstPointer shown = field ? warped(fixed, moving, field).GetPointer() : moving;
    for (itk::ImageRegionConstIteratorWithIndex<Image> at(fixed, fixed->GetBufferedRegion());
         !at.IsAtEnd(); ++at) {
      Image::PointType place;
      fixed->TransformIndexToPhysicalPoint(at.GetIndex(), place);
      Image::IndexType index;
      if (counts(place) && shown->TransformPhysicalPointToIndex(place, index))
        all.push_back(std::abs(double(at.Get()) - double(shown->GetPixel(index))));
    }
  }
  return all;
}

int main(int argc, char** argv) {
  std::vector<const char*> inputs;
  const char *to_warped = nullptr, *to_field = nullptr;
  for (int n = 1; n < argc; ++n) {
    if (!std::strcmp(argv[n], "--warped") && n + 1 < argc)
      to_warped = argv[++n];
    else if (!std::strcmp(argv[n], "--field") && n + 1 < argc)
      to_field = argv[++n];
    else
      inputs.push_back(argv[n]);
  }
  if (inputs.size() < 2 || inputs.size() > 4) {
    std::cerr << "Give a fixed image and a moving one; a true field and a mask if there are any.\n";
    return 2;
  }
  try {
    const auto fixed = itk::ReadImage<Image>(inputs[0]);
    const auto moving = itk::ReadImage<Image>(inputs[1]);
    const Field::Pointer truth =
        inputs.size() > 2 ? itk::ReadImage<Field>(inputs[2]) : Field::Pointer();
    const Mask::Pointer mask =
        inputs.size() > 3 ? itk::ReadImage<Mask>(inputs[3]) : Mask::Pointer();

    const auto row = [&](const char* method, double seconds, const Field* field) {
      std::vector<double> all = errors(fixed, moving, field, truth, mask);
      if (all.empty()) itkGenericExceptionMacro("No sample lies in the mask and in the images");
      double sum = 0.0;
      for (const double error : all) sum += error;
      const auto p95 = all.begin() + std::ptrdiff_t(0.95 * double(all.size() - 1));
      std::nth_element(all.begin(), p95, all.end());
      std::printf("%-36s%7.2f%10.3f%10.3f\n", method, seconds, sum / double(all.size()), *p95);
    };
    const auto seconds_since = [](std::chrono::steady_clock::time_point begin) {
      return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    };

    auto begin = std::chrono::steady_clock::now();
    const auto filter = Filter::New();
    filter->SetFixedImage(fixed);
    filter->SetMovingImage(moving);
    filter->AddObserver(itk::IterationEvent(), Progress::New());
    filter->Update();
    const double palpate_s = seconds_since(begin);
    std::cout << "\rThe field is " << filter->GetVerdict() << ", mean squared difference "
              << filter->GetMetric() << "\n"
              << filter->GetReasons() << (*filter->GetReasons() ? "\n" : "");
    if (to_warped)
      itk::WriteImage(warped(fixed, moving, filter->GetDisplacementField()).GetPointer(),
                      to_warped);
    if (to_field) itk::WriteImage(filter->GetDisplacementField(), to_field);

    std::cout << (truth ? "Distance to the true field, mm" : "Difference of the images")
              << std::endl;
    std::printf("%-36s%7s%10s%10s\n", "", "s", "mean", "95 %");
    row("no motion", 0.0, nullptr);
    // This time includes two steps that ITK's filters do not have: opening the Vulkan device, and
    // checking the field for the verdict.
    row("palpate", palpate_s, filter->GetDisplacementField());
    begin = std::chrono::steady_clock::now();
    auto field = demons<itk::FastSymmetricForcesDemonsRegistrationFilter<Image, Image, Field>>(
        fixed, moving);
    row("ITK, fast symmetric forces Demons", seconds_since(begin), field);
    begin = std::chrono::steady_clock::now();
    field = demons<itk::DiffeomorphicDemonsRegistrationFilter<Image, Image, Field>>(fixed, moving);
    row("ITK, diffeomorphic Demons", seconds_since(begin), field);
  } catch (const itk::ExceptionObject& error) {
    std::cerr << error.GetDescription() << "\n";
    return 1;
  }
  return 0;
}
