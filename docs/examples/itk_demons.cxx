/* ITK's example of Demons registration with palpate in the filter's place.

   cmake -S docs/examples -B examples && cmake --build examples
   examples/itk_demons fixed.nii.gz moving.nii.gz warped.nii.gz [field.mha]

   What was left out of ITK's example: the histogram matching before it, the number of iterations and the standard deviations of its smoothing,
   which palpate does not need. The output is the same: a displacement field in mm on the fixed image's grid, which
   itk::WarpImageFilter takes. */
#include <itkImageFileReader.h>
#include <itkImageFileWriter.h>
#include <itkWarpImageFilter.h>
#include <palpate_itk.h>

#include <iostream>

using Image = itk::Image<float, 3>;
using Field = itk::Image<itk::Vector<float, 3>, 3>;
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

int main(int argc, char** argv) {
  if (argc < 4) {
    std::cerr << "Give a fixed image, a moving one, and where the warped one goes.\n";
    return 2;
  }
  try {
    const auto fixed = itk::ReadImage<Image>(argv[1]);
    const auto moving = itk::ReadImage<Image>(argv[2]);

    const auto filter = Filter::New();
    filter->SetFixedImage(fixed);
    filter->SetMovingImage(moving);
    filter->AddObserver(itk::IterationEvent(), Progress::New());
    filter->Update();
    std::cout << "\rThe field is " << filter->GetVerdict() << ", mean squared difference "
              << filter->GetMetric() << "\n"
              << filter->GetReasons();

    const auto warper = itk::WarpImageFilter<Image, Image, Field>::New();
    warper->SetInput(moving);
    warper->SetDisplacementField(filter->GetDisplacementField());
    warper->SetOutputParametersFromImage(fixed);
    itk::WriteImage(warper->GetOutput(), argv[3]);
    if (argc > 4) itk::WriteImage(filter->GetDisplacementField(), argv[4]);
  } catch (const itk::ExceptionObject& error) {
    std::cerr << error.GetDescription() << "\n";
    return 1;
  }
  return 0;
}
