/* A moving volume in a VTK pipeline: the inputs are frames, the output is the volume at any phase.

   cmake -S docs/examples -B examples && cmake --build examples
   examples/vtk_volume [--cycle SECONDS] [--preset NAME] moved.vti frame_00.mha frame_01.mha
   frame_02.mha ...

   Warps one frame (the reference frame) to the times of all others, and prints the mean difference
   to each of them, with motion and without. Then it estimates the displacement from the first frame
   to the second, and writes the volume at phase 0.25 of the cycle to a file. To show the volume in
   a window, connect the sequence's output port to a vtkSmartVolumeMapper instead of the writer.

   vtkMetaImageReader of VTK 9.1 ignores the directions in the file's header (TransformMatrix), and
   vtkMetaImageWriter writes none. So the directions are read here, and the volume is written as
   .vti, which stores them. */
#include <palpate_vtk.h>
#include <vtkMetaImageReader.h>
#include <vtkSmartPointer.h>
#include <vtkTrivialProducer.h>
#include <vtkXMLImageDataWriter.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

using Image = vtkSmartPointer<vtkImageData>;

// Sets the image's direction from a MetaImage's header: for each axis of the image a unit vector in
// patient space.
static void set_direction(vtkImageData* image, const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string line;
  while (std::getline(file, line) && line.rfind("ElementDataFile", 0) != 0) {
    std::istringstream words(line);
    std::string name, equals;
    if (!(words >> name >> equals) || name != "TransformMatrix") continue;
    double direction[9];
    for (int axis = 0; axis < 3; ++axis)
      for (int row = 0; row < 3; ++row) words >> direction[3 * row + axis];
    if (words) image->SetDirectionMatrix(direction);
  }
}

static Image read(const std::string& path) {
  vtkNew<vtkMetaImageReader> reader;
  if (!reader->CanReadFile(path.c_str())) return nullptr;
  reader->SetFileName(path.c_str());
  reader->Update();
  const Image image = reader->GetOutput();
  if (image->GetNumberOfPoints() == 0) return nullptr;
  set_direction(image, path);
  return image;
}

// The mean of |one - other| over all voxels.
static double mean_difference(vtkImageData* one, vtkImageData* other) {
  vtkDataArray* const a = one->GetPointData()->GetScalars();
  vtkDataArray* const b = other->GetPointData()->GetScalars();
  double sum = 0.0;
  for (vtkIdType n = 0; n < a->GetNumberOfTuples(); ++n)
    sum += std::abs(a->GetTuple1(n) - b->GetTuple1(n));
  return sum / double(a->GetNumberOfTuples());
}

static double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

int main(int argc, char** argv) {
  double cycle_s = 1.0;
  const char* preset = "balanced";
  std::vector<std::string> paths;
  for (int n = 1; n < argc; ++n) {
    const std::string word = argv[n];
    if (word == "--cycle" && n + 1 < argc)
      cycle_s = std::atof(argv[++n]);
    else if (word == "--preset" && n + 1 < argc)
      preset = argv[++n];
    else
      paths.push_back(word);
  }
  if (paths.size() < 4) {
    std::cerr << "Give where the moved volume goes, and three frames of a cycle or more.\n";
    return 2;
  }

  std::vector<Image> frames;
  vtkNew<vtkPalpateSequence> sequence;
  for (size_t k = 1; k < paths.size(); ++k) {
    const Image frame = read(paths[k]);
    if (!frame) {
      std::cerr << paths[k] << " is not read as a MetaImage.\n";
      return 1;
    }
    frames.push_back(frame);
    vtkNew<vtkTrivialProducer> producer;
    producer->SetOutput(frame);
    sequence->AddInputConnection(producer->GetOutputPort());
  }
  sequence->CyclicOn();
  sequence->SetCycle(cycle_s);
  sequence->SetPreset(preset);
  const auto begin = std::chrono::steady_clock::now();
  if (!sequence->GetExecutive()->Update()) return 1;  // VTK has printed why
  const auto reference = size_t(sequence->GetReferenceFrame());
  std::cout << "Frame " << reference << " moves; the motion is " << sequence->GetVerdict()
            << ", found in " << seconds_since(begin) << " s\n"
            << sequence->GetReasons() << "\n"
            << "frame  moved  still  (mean difference to the real frame)\n";

  double sum_moved = 0.0, sum_still = 0.0, sum_seconds = 0.0;
  for (size_t k = 0; k < frames.size(); ++k) {
    const auto asked = std::chrono::steady_clock::now();
    sequence->SetPhase(double(k) / double(frames.size()));
    sequence->Update();
    sum_seconds += seconds_since(asked);
    if (k == reference) continue;
    const double moved = mean_difference(sequence->GetOutput(), frames[k]);
    const double still = mean_difference(frames[reference], frames[k]);
    std::cout << k << "  " << moved << "  " << still << "\n";
    sum_moved += moved;
    sum_still += still;
  }
  const auto others = double(frames.size() - 1);
  std::cout << "All: moved " << sum_moved / others << ", still " << sum_still / others << "; "
            << sum_seconds / double(frames.size()) << " s a phase\n";

  vtkNew<vtkPalpateMotion> motion;
  motion->SetInputData(0, frames[0]);
  motion->SetInputData(1, frames[1]);
  motion->SetPreset(preset);
  if (!motion->GetExecutive()->Update()) return 1;
  vtkDataArray* const u = motion->GetOutput()->GetPointData()->GetScalars();
  double sum_mm = 0.0, most_mm = 0.0;
  for (vtkIdType n = 0; n < u->GetNumberOfTuples(); ++n) {
    const double* const v = u->GetTuple3(n);
    const double length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    sum_mm += length;
    most_mm = std::max(most_mm, length);
  }
  std::cout << "Frame 0 to 1: the field is " << motion->GetVerdict() << ", "
            << sum_mm / double(u->GetNumberOfTuples()) << " mm on average, at most " << most_mm
            << " mm\n"
            << motion->GetReasons() << "\n";

  vtkNew<vtkXMLImageDataWriter> writer;
  writer->SetInputConnection(sequence->GetOutputPort());
  writer->SetFileName(paths[0].c_str());
  sequence->SetPhase(0.25);
  return writer->Write() && writer->GetErrorCode() == 0 ? 0 : 1;
}
