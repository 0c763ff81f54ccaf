#include "tests/devices/emulated_usb.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <ctime>
#include <filesystem>

namespace palpate::devices::test {
namespace {

std::string hex(const Bytes& bytes) {
  std::string text;
  for (const uint8_t byte : bytes) {
    char two[3];
    std::snprintf(two, sizeof two, "%02X", byte);
    text += two;
  }
  return text;
}

Bytes descriptor_bytes(const Descriptors& d) {
  const auto low = [](uint16_t v) { return uint8_t(v & 0xff); };
  const auto high = [](uint16_t v) { return uint8_t(v >> 8); };
  Bytes bytes = {18,
                 1,
                 0x00,
                 0x02,
                 0,
                 0,
                 0,
                 64,
                 low(d.vendor),
                 high(d.vendor),
                 low(d.product),
                 high(d.product),
                 0x00,
                 0x05,
                 1,
                 2,
                 3,
                 1};
  const uint8_t endpoints = d.out_endpoint ? 2 : 1;
  const auto total = uint8_t(9 + 9 + 7 * endpoints);
  const Bytes rest = {9, 2, total, 0, 1, 1, 0, 0x80, 45, 9, 4, 0, 0, endpoints, d.interface_class,
                      0, 0, 0};
  bytes.insert(bytes.end(), rest.begin(), rest.end());
  const uint8_t kind = d.interrupt ? 3 : 2, interval = d.interrupt ? 8 : 0;
  for (const uint8_t endpoint : {d.in_endpoint, d.out_endpoint}) {
    if (endpoint == 0) continue;
    const Bytes one = {7, 5, endpoint, kind, d.packet_bytes, 0, interval};
    bytes.insert(bytes.end(), one.begin(), one.end());
  }
  return bytes;
}

Bytes string_descriptor(const std::string& text) {
  Bytes bytes = {uint8_t(2 + 2 * text.size()), 3};
  for (const char c : text) {
    bytes.push_back(uint8_t(c));
    bytes.push_back(0);
  }
  return bytes;
}

/// The pointer that umockdev passes on is the request's argument itself.
template <class T>
T argument(UMockdevIoctlClient* client) {
  return *reinterpret_cast<T*>(umockdev_ioctl_client_get_arg(client)->data);
}

void answer(UMockdevIoctlClient* client, int negative_errno) {
  umockdev_ioctl_client_complete(client, negative_errno == 0 ? 0 : -1, -negative_errno);
}

}  // namespace

int64_t monotonic_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return int64_t(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
}

EmulatedBus& EmulatedBus::get() {
  // Lives to the end of the process: libusb's own threads use it.
  static EmulatedBus bus;
  return bus;
}

EmulatedBus::EmulatedBus() {
  // Its socket's path must fit into 108 bytes, wherever the build is.
  setenv("TMPDIR", "/tmp", 1);
  // umockdev sleeps for zero microseconds after every request, which takes 50 with the default
  // timer slack.
  prctl(PR_SET_TIMERSLACK, 1);
  testbed_ = umockdev_testbed_new();
  // A thread that acts as an ordinary user puts its sockets there.
  chmod(root().c_str(), 0777);
}

std::string EmulatedBus::root() const {
  // Owned by the caller.
  gchar* const path = umockdev_testbed_get_root_dir(testbed_);
  const std::string copy = path;
  g_free(path);
  return copy;
}

EmulatedDevice::EmulatedDevice(Descriptors descriptors, int port)
    : descriptors_(std::move(descriptors)), port_(port) {
  EmulatedBus::get();
  thread_ = std::thread([this] { run(); });
}

EmulatedDevice::~EmulatedDevice() {
  stop();
}

void EmulatedDevice::stop() {
  unplug();
  {
    const Lock lock(mutex_);
    if (stopping_) return;
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
  for (const auto& [path, handler] : old_handlers_) {
    umockdev_testbed_detach_ioctl(EmulatedBus::get().testbed(), path.c_str(), nullptr);
    g_signal_handlers_disconnect_by_data(handler, this);
    g_object_unref(handler);
  }
}

std::string EmulatedDevice::node() const {
  char name[32];
  std::snprintf(name, sizeof name, "bus/usb/001/%03d", address_);
  return name;
}

void EmulatedDevice::plug() {
  EmulatedBus& bus = EmulatedBus::get();
  {
    const Lock lock(mutex_);
    address_ = bus.next_address();
    present_ = true;
    ready_ = true;
    owner_ = nullptr;
    plugged();
  }
  handler_ = umockdev_ioctl_base_new();
  g_signal_connect(handler_, "handle-ioctl", G_CALLBACK(on_ioctl), this);
  g_signal_connect(handler_, "client-vanished", G_CALLBACK(on_vanished), this);
  GError* error = nullptr;
  umockdev_testbed_attach_ioctl(bus.testbed(), ("/dev/" + node()).c_str(), handler_, &error);
  ASSERT_EQ(error, nullptr) << error->message;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(bus.root() + "/ioctl"))
    // Sockets too: a thread may act as an ordinary user.
    chmod(entry.path().c_str(), 0777);

  // The node is a FIFO of one page. With a byte in it, it is not writable; usbfs shows in this way
  // that no transfer is done. Made before the uevent, so that no program opens a plain file.
  const std::string path = bus.root() + "/dev/" + node();
  const std::string name = "1-" + std::to_string(port_), number = std::to_string(address_);
  const std::string text =
      "P: /devices/usb1/" + name + "\nN: " + node() + "\nE: SUBSYSTEM=usb\nE: DRIVER=usb\n" +
      "E: BUSNUM=001\nE: DEVNUM=" + node().substr(12) + "\nE: DEVNAME=/dev/" + node() +
      "\nE: DEVTYPE=usb_device\nA: bConfigurationValue=1\\n\nA: busnum=1\\n\nA: devnum=" + number +
      "\\n\nA: speed=12\\n\nH: descriptors=" + hex(descriptor_bytes(descriptors_)) + "\n";
  umockdev_testbed_add_from_string(bus.testbed(), text.c_str(), &error);
  ASSERT_EQ(error, nullptr) << error->message;
  std::filesystem::remove(path);
  ASSERT_EQ(mkfifo(path.c_str(), 0666), 0) << path;
  chmod(path.c_str(), 0666);
  const Lock lock(mutex_);
  ready_file_ = open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  ASSERT_GE(ready_file_, 0) << path;
  fcntl(ready_file_, F_SETPIPE_SZ, 4096);
  show_ready();
}

void EmulatedDevice::unplug() {
  EmulatedBus& bus = EmulatedBus::get();
  {
    const Lock lock(mutex_);
    if (!present_) return;
    present_ = false;
    for (Urb& urb : waiting_) {
      urb.in.clear();
      urb.status = -ESHUTDOWN;
      finished_.push_back(std::move(urb));
    }
    waiting_.clear();
    show_ready();
  }
  const std::string device = "/sys/devices/usb1/1-" + std::to_string(port_);
  umockdev_testbed_uevent(bus.testbed(), device.c_str(), "remove");
  umockdev_testbed_remove_device(bus.testbed(), device.c_str());
  const Lock lock(mutex_);
  close(ready_file_);
  ready_file_ = -1;
  old_handlers_.emplace_back("/dev/" + node(), handler_);
  handler_ = nullptr;
}

void EmulatedDevice::permit(bool allowed) {
  const std::string path = EmulatedBus::get().root() + "/dev/" + node();
  ASSERT_EQ(chmod(path.c_str(), allowed ? 0666 : 0), 0);
}

void EmulatedDevice::bind_kernel_driver(const std::string& name) {
  const Lock lock(mutex_);
  driver_ = name;
}

std::string EmulatedDevice::kernel_driver() const {
  const Lock lock(mutex_);
  return driver_;
}

void EmulatedDevice::claim_elsewhere(bool claimed) {
  const Lock lock(mutex_);
  claimed_elsewhere_ = claimed;
}

int EmulatedDevice::resets_of_halts() const {
  const Lock lock(mutex_);
  return halts_cleared_;
}

int EmulatedDevice::control(uint8_t type, uint8_t request, uint16_t value, const Bytes&,
                            Bytes& in) {
  constexpr uint8_t kGetDescriptor = 6, kString = 3;
  if (type != 0x80 || request != kGetDescriptor || value >> 8 != kString) return -EPIPE;
  if ((value & 0xff) == 0)
    in = {4, 3, 0x09, 0x04};  // English
  else if ((value & 0xff) == 2)
    in = string_descriptor(descriptors_.product_name);
  else
    return -EPIPE;
  return 0;
}

gboolean EmulatedDevice::on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self) {
  return static_cast<EmulatedDevice*>(self)->ioctl(client);
}

void EmulatedDevice::on_vanished(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self) {
  auto* device = static_cast<EmulatedDevice*>(self);
  const Lock lock(device->mutex_);
  const auto of_client = [client](const Urb& urb) { return urb.client == client; };
  std::erase_if(device->waiting_, of_client);
  std::erase_if(device->finished_, of_client);
  if (device->owner_ == client) device->owner_ = nullptr;
  device->show_ready();
}

gboolean EmulatedDevice::ioctl(UMockdevIoctlClient* client) {
  const Lock lock(mutex_);
  const auto request = umockdev_ioctl_client_get_request(client);
  const bool reaps = request == USBDEVFS_REAPURB || request == USBDEVFS_REAPURBNDELAY;
  const bool here = present_ && "/dev/" + node() == umockdev_ioctl_client_get_devnode(client);
  if (!here && !reaps) {
    answer(client, -ENODEV);
    return TRUE;
  }
  switch (request) {
    case USBDEVFS_GET_CAPABILITIES:
      *argument<uint32_t*>(client) = 0;
      answer(client, 0);
      break;
    case USBDEVFS_GETDRIVER:
      if (!driver_.empty())
        std::strncpy(argument<usbdevfs_getdriver*>(client)->driver, driver_.c_str(),
                     USBDEVFS_MAXDRIVERNAME);
      answer(client, driver_.empty() ? -ENODATA : 0);
      break;
    case USBDEVFS_IOCTL:
      answer(client, driver_ioctl(*argument<usbdevfs_ioctl*>(client)));
      break;
    case USBDEVFS_CLAIMINTERFACE:
      answer(client, claim(client));
      break;
    case USBDEVFS_RELEASEINTERFACE:
      if (owner_ == client) owner_ = nullptr;
      answer(client, 0);
      break;
    case USBDEVFS_CLEAR_HALT:
      ++halts_cleared_;
      cleared_halt(uint8_t(*argument<unsigned*>(client)));
      answer(client, 0);
      break;
    case USBDEVFS_SETCONFIGURATION:
    case USBDEVFS_SETINTERFACE:
    case USBDEVFS_RESET:
      answer(client, 0);
      break;
    case USBDEVFS_SUBMITURB:
      submit(client, argument<usbdevfs_urb*>(client));
      break;
    case USBDEVFS_REAPURB:
    case USBDEVFS_REAPURBNDELAY:
      reap(client, argument<void**>(client), here);
      break;
    case USBDEVFS_DISCARDURB:
      answer(client, discard(client, argument<usbdevfs_urb*>(client)));
      break;
    default:
      answer(client, -ENOTTY);
  }
  return TRUE;
}

int EmulatedDevice::claim(UMockdevIoctlClient* client) {
  if (claimed_elsewhere_ || !driver_.empty() || (owner_ && owner_ != client)) return -EBUSY;
  owner_ = client;
  return 0;
}

int EmulatedDevice::driver_ioctl(const usbdevfs_ioctl& request) {
  if (request.ioctl_code == int(USBDEVFS_DISCONNECT)) {
    if (driver_.empty()) return -ENODATA;
    detached_driver_ = driver_;
    driver_.clear();
    return 0;
  }
  if (request.ioctl_code != int(USBDEVFS_CONNECT)) return -ENOTTY;
  driver_ = detached_driver_;
  return 0;
}

void EmulatedDevice::submit(UMockdevIoctlClient* client, usbdevfs_urb* user) {
  const auto* bytes = static_cast<const uint8_t*>(user->buffer);
  Urb urb{client, user, user->type, user->endpoint, size_t(user->buffer_length), {}, {}, 0};
  const bool is_control = urb.type == USBDEVFS_URB_TYPE_CONTROL;
  if (is_control || !(urb.endpoint & 0x80)) urb.out.assign(bytes, bytes + urb.length);
  answer(client, 0);
  if (is_control) {
    submit_control(std::move(urb));
  } else if (urb.endpoint & 0x80) {
    waiting_.push_back(std::move(urb));
  } else {
    const int status = take(urb.out);
    if (status == kNever)
      waiting_.push_back(std::move(urb));
    else
      finish(std::move(urb), status);
  }
  due_ns_ = serve(monotonic_ns());
  changed_.notify_all();
}

void EmulatedDevice::submit_control(Urb urb) {
  const Bytes setup(urb.out.begin(), urb.out.begin() + 8);
  const Bytes out(urb.out.begin() + 8, urb.out.end());
  const int status = control(setup[0], setup[1], uint16_t(setup[2] | setup[3] << 8), out, urb.in);
  const auto wanted = size_t(setup[6] | setup[7] << 8);
  if (urb.in.size() > wanted) urb.in.resize(wanted);
  if (status == kNever)
    waiting_.push_back(std::move(urb));
  else
    finish(std::move(urb), status);
}

void EmulatedDevice::finish(Urb urb, int status) {
  urb.status = status;
  finished_.push_back(std::move(urb));
  show_ready();
}

void EmulatedDevice::complete_read(int status, Bytes bytes) {
  const auto read = std::find_if(waiting_.begin(), waiting_.end(),
                                 [](const Urb& urb) { return (urb.endpoint & 0x80) != 0; });
  if (read == waiting_.end()) return;
  Urb urb = std::move(*read);
  waiting_.erase(read);
  if (bytes.size() > urb.length) {
    bytes.resize(urb.length);
    status = -EOVERFLOW;
  }
  urb.in = std::move(bytes);
  finish(std::move(urb), status);
}

void EmulatedDevice::reap(UMockdevIoctlClient* client, void** user, bool here) {
  const auto done = std::find_if(finished_.begin(), finished_.end(),
                                 [client](const Urb& urb) { return urb.client == client; });
  if (done == finished_.end()) {
    answer(client, here ? -EAGAIN : -ENODEV);
    return;
  }
  const bool is_control = done->type == USBDEVFS_URB_TYPE_CONTROL;
  auto* bytes = static_cast<uint8_t*>(done->user->buffer) + (is_control ? 8 : 0);
  std::copy(done->in.begin(), done->in.end(), bytes);
  const bool read = is_control || (done->endpoint & 0x80);
  done->user->actual_length = int(read ? done->in.size() : done->status ? 0 : done->out.size());
  done->user->status = done->status;
  *user = done->user;
  finished_.erase(done);
  show_ready();
  answer(client, 0);
}

int EmulatedDevice::discard(UMockdevIoctlClient* client, usbdevfs_urb* user) {
  const auto found = std::find_if(waiting_.begin(), waiting_.end(), [&](const Urb& urb) {
    return urb.client == client && urb.user == user;
  });
  if (found == waiting_.end()) return -EINVAL;
  Urb urb = std::move(*found);
  waiting_.erase(found);
  urb.in.clear();
  finish(std::move(urb), -ENOENT);
  return 0;
}

/// The node is writable while there is a transfer to reap, or the device is gone.
void EmulatedDevice::show_ready() {
  const bool ready = !finished_.empty() || !present_;
  if (ready_file_ < 0 || ready == ready_) return;
  uint8_t byte = 0;
  const auto count = ready ? ::read(ready_file_, &byte, 1) : ::write(ready_file_, &byte, 1);
  if (count == 1) ready_ = ready;
}

void EmulatedDevice::changed() {
  due_ns_ = 0;
  changed_.notify_all();
}

void EmulatedDevice::run() {
  prctl(PR_SET_TIMERSLACK, 1);
  Lock lock(mutex_);
  while (!stopping_) {
    const int64_t now = monotonic_ns();
    if (now >= due_ns_) {
      due_ns_ = present_ ? serve(now) : kNoTime;
      continue;
    }
    const auto until = std::chrono::steady_clock::now() +
                       std::chrono::nanoseconds(std::min<int64_t>(due_ns_ - now, 1'000'000'000));
    changed_.wait_until(lock, until);
  }
}

}  // namespace palpate::devices::test
