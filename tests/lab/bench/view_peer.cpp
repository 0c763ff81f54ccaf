// VTK's two ray casters, that of the GPU and the fixed-point one of the CPU, on the same data,
// looks and eyes as `palpate-lab view`, one line per measurement:
//   look samples_per_voxel seconds psnr_db mapper
// Needs an X server (Xvfb is enough). The pictures of each are compared with its own at an eighth
// of a voxel, or at half a voxel where that is more exact. Both can also draw rays for every second
// pixel only along both axes, and enlarge that: a line for either way.
#include <vtkCamera.h>
#include <vtkColorTransferFunction.h>
#include <vtkFixedPointVolumeRayCastMapper.h>
#include <vtkGPUVolumeRayCastMapper.h>
#include <vtkImageData.h>
#include <vtkLight.h>
#include <vtkNew.h>
#include <vtkPiecewiseFunction.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkUnsignedCharArray.h>
#include <vtkVolume.h>
#include <vtkVolumeProperty.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>

#include "module/scene/transform.h"
#include "tests/lab/studies/view_case.h"

#include <vtkAutoInit.h>
VTK_MODULE_INIT(vtkRenderingOpenGL2)
VTK_MODULE_INIT(vtkRenderingVolumeOpenGL2)

using namespace palpate;

namespace {

double seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// The data in volume space, mm: the axes of LPS are rotated by moving the samples.
vtkNew<vtkImageData> image_of(const Volume& data) {
  vtkNew<vtkImageData> image;
  const glm::ivec3 n = data.grid.size;
  image->SetDimensions(n.x, n.z, n.y);
  image->SetSpacing(data.grid.spacing_mm.x, data.grid.spacing_mm.z, data.grid.spacing_mm.y);
  const glm::dvec3 low = data.grid.origin_mm;
  image->SetOrigin(low.x, low.z, -(low.y + data.grid.spacing_mm.y * (n.y - 1)));
  image->AllocateScalars(VTK_FLOAT, 1);
  float* out = static_cast<float*>(image->GetScalarPointer());
  for (int j = n.y - 1; j >= 0; --j)
    for (int k = 0; k < n.z; ++k)
      for (int i = 0; i < n.x; ++i) *out++ = data.at(i, j, k);
  return image;
}

void set_look(vtkVolumeProperty* property, const Look& look) {
  vtkNew<vtkPiecewiseFunction> opacity;
  vtkNew<vtkColorTransferFunction> colour;
  for (const LookPoint& p : look.points) {
    opacity->AddPoint(p.value, p.opacity);
    colour->AddRGBPoint(p.value, p.colour.x, p.colour.y, p.colour.z);
  }
  property->SetScalarOpacity(opacity);
  property->SetColor(colour);
  property->SetScalarOpacityUnitDistance(look.thickness_mm);
  property->SetInterpolationTypeToLinear();
  property->ShadeOn();
  property->SetAmbient(look.shine.ambient);
  property->SetDiffuse(look.shine.diffuse);
  property->SetSpecular(look.shine.specular);
  property->SetSpecularPower(32.0);
}

void set_eye(vtkCamera* camera, const Eye& eye) {
  const glm::dvec3 at = 1e3 * eye.position_m;
  const glm::dvec3 ahead = eye.orientation * glm::dvec3(0, 0, -1);
  const glm::dvec3 up = eye.orientation * glm::dvec3(0, 1, 0);
  camera->SetPosition(at.x, at.y, at.z);
  camera->SetFocalPoint(at.x + 250 * ahead.x, at.y + 250 * ahead.y, at.z + 250 * ahead.z);
  camera->SetViewUp(up.x, up.y, up.z);
  camera->SetViewAngle(2.0 * std::atan(eye.tan_up) * 180.0 / 3.14159265358979323846);
  camera->SetClippingRange(10.0, 1000.0);
}

std::vector<unsigned char> pixels_of(vtkRenderWindow* window) {
  vtkNew<vtkUnsignedCharArray> pixels;
  window->GetPixelData(0, 0, studies::kViewSize.width - 1, studies::kViewSize.height - 1, 0,
                       pixels);
  return {pixels->GetPointer(0), pixels->GetPointer(0) + pixels->GetNumberOfValues()};
}

}  // namespace

int main(int count, char** arguments) {
  const auto eyes = studies::view_eyes();
  const vtkNew<vtkImageData> image = image_of(studies::view_data());
  vtkNew<vtkGPUVolumeRayCastMapper> of_gpu;
  of_gpu->SetInputData(image);
  of_gpu->SetAutoAdjustSampleDistances(0);
  vtkNew<vtkFixedPointVolumeRayCastMapper> fixed_point;
  fixed_point->SetInputData(image);
  fixed_point->SetAutoAdjustSampleDistances(0);
  vtkNew<vtkVolume> volume;
  vtkNew<vtkRenderer> renderer;
  renderer->AddVolume(volume);
  renderer->SetBackground(0.03, 0.035, 0.05);
  vtkNew<vtkRenderWindow> window;
  window->SetMultiSamples(0);
  window->SetSize(studies::kViewSize.width, studies::kViewSize.height);
  window->AddRenderer(renderer);

  const double voxel_mm = 0.5;
  // Rays for pixels so far apart.
  const auto set_pixels_apart = [&](float pixels) {
    of_gpu->SetImageSampleDistance(pixels);
    fixed_point->SetImageSampleDistance(pixels);
    fixed_point->SetMinimumImageSampleDistance(pixels);
    fixed_point->SetMaximumImageSampleDistance(pixels);
  };
  for (const bool dense : {false, true})
    for (const bool gpu : {true, false}) {
      const Look look = studies::view_look(dense);
      set_look(volume->GetProperty(), look);
      if (gpu)
        volume->SetMapper(of_gpu);
      else
        volume->SetMapper(fixed_point);
      const auto draw = [&](double samples_per_voxel, bool jitter) {
        const float distance = float(voxel_mm / samples_per_voxel);
        of_gpu->SetSampleDistance(distance);
        of_gpu->SetUseJittering(jitter);
        fixed_point->SetSampleDistance(distance);
        std::vector<unsigned char> both;
        for (const Eye& eye : eyes) {
          set_eye(renderer->GetActiveCamera(), eye);
          window->Render();
          const auto one = pixels_of(window);
          both.insert(both.end(), one.begin(), one.end());
        }
        return both;
      };
      // The opacities of short steps are rounded to 15 bits: with 8 samples per voxel a dense
      // picture of the fixed-point mapper has 29 dB against its own with 2.
      set_pixels_apart(1.0F);
      const std::vector<unsigned char> reference = draw(gpu || !dense ? 8.0 : 2.0, false);
      for (const float apart : {1.0F, 2.0F})
        for (const double rate : studies::kRates) {
          set_pixels_apart(apart);
          draw(rate, true);
          double best = 1e9;
          std::vector<unsigned char> picture;
          for (int run = 0; run < 2; ++run) {
            const double start = seconds();
            picture = draw(rate, true);
            best = std::min(best, seconds() - start);
          }
          const double quality_db = studies::psnr_db(picture, reference);
          if (quality_db < studies::kEnoughDb) continue;
          // Only the coarsest rate with sufficient quality counts.
          std::printf("%s %.4f %.6f %.4f %s%s\n", look.name.c_str(), rate, best, quality_db,
                      gpu ? "GPU" : "fixed-point", apart > 1.0F ? ",every-second-pixel" : "");
          std::fflush(stdout);
          break;
        }
      if (count > 1) {
        std::ofstream file(std::string(arguments[1]) + "/vtk_" + look.name +
                               (gpu ? "_gpu.ppm" : "_fixed_point.ppm"),
                           std::ios::binary);
        file << "P6 " << studies::kViewSize.width << " " << studies::kViewSize.height << " 255\n";
        const size_t row = size_t(studies::kViewSize.width) * 3;
        for (int y = studies::kViewSize.height - 1; y >= 0; --y)
          file.write(reinterpret_cast<const char*>(reference.data()) + size_t(y) * row,
                     std::streamsize(row));
      }
    }
}
