// A source of live images as others write them: with the OpenIGTLink library.
// igtl_source PORT HZ SECONDS cycle|free|FOLDER
#include <igtlImageMessage.h>
#include <igtlServerSocket.h>
#include <igtlTimeStamp.h>
#include <igtlTransformMessage.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "integration/files/read_volume.h"

namespace {

/// A ball of 64^3 samples, 1.5 mm apart, with a radius that depends on a phase, and noise.
palpate::Volume ball(double phase, unsigned seed) {
  palpate::Volume volume;
  volume.grid.size = {64, 64, 64};
  volume.grid.spacing_mm = glm::dvec3(1.5);
  volume.grid.origin_mm = glm::dvec3(-0.75 * 63);
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0.0, 10.0);
  for (int k = 0; k < 64; ++k)
    for (int j = 0; j < 64; ++j)
      for (int i = 0; i < 64; ++i) {
        const glm::dvec3 at = glm::dvec3(i, j, k) - 31.5;
        const double r = glm::length(at * glm::dvec3(1.0, 1.1, 1.0)),
                     radius = 18.0 + 2.5 * std::sin(phase);
        volume.values.push_back(
            float(1000.0 / (1.0 + std::exp((r - radius) / 1.5)) + noise(random)));
      }
  return volume;
}

igtl::ImageMessage::Pointer message_of(const palpate::Volume& volume) {
  auto message = igtl::ImageMessage::New();
  int size[3];
  float spacing[3];
  for (int a = 0; a < 3; ++a) {
    size[a] = volume.grid.size[a];
    spacing[a] = float(volume.grid.spacing_mm[a]);
  }
  message->SetDimensions(size);
  message->SetSpacing(spacing);
  message->SetScalarType(igtl::ImageMessage::TYPE_FLOAT32);
  message->SetEndian(igtl::ImageMessage::ENDIAN_LITTLE);
  message->SetDeviceName("Source");
  int first[3] = {0, 0, 0};
  message->SetSubVolume(size, first);
  message->AllocateScalars();
  igtl::Matrix4x4 matrix;
  igtl::IdentityMatrix(matrix);
  const glm::dvec3 centre = volume.grid.lps_from_index(0.5 * glm::dvec3(volume.grid.size - 1));
  for (int r = 0; r < 3; ++r) {
    const double ras = r < 2 ? -1.0 : 1.0;
    for (int c = 0; c < 3; ++c) matrix[r][c] = float(ras * volume.grid.direction[c][r]);
    matrix[r][3] = float(ras * centre[r]);
  }
  message->SetMatrix(matrix);
  std::memcpy(message->GetScalarPointer(), volume.values.data(),
              volume.values.size() * sizeof(float));
  return message;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 5) return 2;
  const int port = std::atoi(argv[1]);
  const double hz = std::atof(argv[2]), seconds = std::atof(argv[3]);
  const std::string kind = argv[4];
  std::vector<palpate::Volume> frames;
  if (kind == "cycle") {
    for (unsigned k = 0; k < 40; ++k) frames.push_back(ball(2 * M_PI * k / 20.0, k));
  } else if (kind == "free") {
    for (unsigned k = 0; k < 60; ++k)
      frames.push_back(ball(0.37 * k + 0.9 * std::sin(0.611 * k), k));
  } else {
    std::vector<std::filesystem::path> paths;
    for (const auto& entry : std::filesystem::directory_iterator(kind))
      if (entry.path().filename().string().starts_with("frame_")) paths.push_back(entry.path());
    std::sort(paths.begin(), paths.end());
    for (const auto& path : paths) {
      auto frame = palpate::files::read_volume(path);
      if (!frame) {
        std::fprintf(stderr, "%s\n", frame.error().message.c_str());
        return 2;
      }
      frames.push_back(std::move(*frame));
    }
  }
  auto server = igtl::ServerSocket::New();
  if (server->CreateServer(port) < 0) return 1;
  std::printf("listening\n");
  std::fflush(stdout);
  const auto socket = server->WaitForConnection(20'000);
  if (socket.IsNull()) return 1;
  const auto begin = std::chrono::steady_clock::now();
  for (size_t k = 0; double(k) < hz * seconds; ++k) {
    std::this_thread::sleep_until(begin + std::chrono::duration<double>(double(k) / hz));
    const auto message = message_of(frames[k % frames.size()]);
    auto now = igtl::TimeStamp::New();
    now->GetTime();
    message->SetTimeStamp(now);
    message->Pack();
    if (!socket->Send(message->GetPackPointer(), message->GetPackSize())) break;
  }
  socket->CloseSocket();
  return 0;
}
