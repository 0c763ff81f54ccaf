// An emulated force device outside the engine's process: Haply's service, with a hand that goes
// into the volume until it is pushed with 2.5 N. A force is valid for its message only: without a
// new one for 10 ms the motors are off. Prints the port, the force, and then when the motors went
// off (CLOCK_MONOTONIC, ns), a line each.
#include <iostream>

#include "tests/devices/emulated_haply.h"

int main() {
  using namespace std::chrono;
  palpate::devices::test::EmulatedHaply service;
  std::cout << service.port() << std::endl;
  const auto now = [] { return steady_clock::now(); };
  // Free until the loop's start is over, then inwards by 20 mm/s.
  const auto end = now() + seconds(60);
  auto started = now(), last_message = now();
  size_t messages = 0;
  bool is_pressed = false;
  double z_m = 0.06;
  while (now() < end) {
    std::this_thread::sleep_for(milliseconds(1));
    if (const size_t count = service.received_count(); count != messages) {
      if (messages == 0) started = now();
      messages = count;
      last_message = now();
    } else if (is_pressed && now() - last_message > milliseconds(10)) {
      std::cout << duration_cast<nanoseconds>(now().time_since_epoch()).count() << std::endl;
      return 0;
    }
    const double force_n = glm::length(service.force_n());
    if (!is_pressed && force_n >= 2.5) {
      is_pressed = true;
      std::cout << force_n << std::endl;
    }
    if (!is_pressed && messages > 0 && now() - started > seconds(4) && z_m > 0.02) z_m -= 20e-6;
    service.place({0.0, 0.0, z_m});
  }
  return 1;
}
