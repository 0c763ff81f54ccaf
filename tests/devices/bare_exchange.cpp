#include "tests/devices/bare_exchange.h"

#include <array>

#include "integration/devices/falcon_protocol.h"
#include "integration/devices/falcon_setup.h"
#include "integration/devices/usb.h"

namespace palpate::devices::test {
namespace {

constexpr unsigned kTimeoutMs = 50;

bool is_falcon(uint16_t vendor, uint16_t product) {
  return vendor == falcon::kVendor && product == falcon::kProduct;
}

void LIBUSB_CALL on_done(libusb_transfer* transfer) {
  *static_cast<int*>(transfer->user_data) = 1;
}

}  // namespace

struct BareExchange::Parts {
  usb::ContextPtr context;
  usb::HandlePtr handle;
  usb::TransferPtr in, out;
  std::array<uint8_t, falcon::kInBytes> in_bytes{};
  falcon::Packet out_bytes = falcon::encode({});
  falcon::AnswerStream stream;

  bool read(int got) {
    if (got <= int(falcon::kStatusBytes)) return false;
    const std::span<const uint8_t> bytes(in_bytes);
    return stream.read(bytes.subspan(falcon::kStatusBytes, size_t(got) - falcon::kStatusBytes)) > 0;
  }
  bool one_after_the_other() {
    int count = 0;
    if (libusb_bulk_transfer(handle.get(), falcon::kEndpointOut, out_bytes.data(),
                             int(out_bytes.size()), &count, kTimeoutMs) != LIBUSB_SUCCESS)
      return false;
    for (int tries = 0; tries < int(kTimeoutMs); ++tries) {
      if (libusb_bulk_transfer(handle.get(), falcon::kEndpointIn, in_bytes.data(),
                               int(in_bytes.size()), &count, kTimeoutMs) != LIBUSB_SUCCESS)
        return false;
      if (read(count)) return true;
    }
    return false;
  }
  bool together() {
    int in_done = 0, out_done = 0;
    libusb_fill_bulk_transfer(in.get(), handle.get(), falcon::kEndpointIn, in_bytes.data(),
                              int(in_bytes.size()), on_done, &in_done, kTimeoutMs);
    libusb_fill_bulk_transfer(out.get(), handle.get(), falcon::kEndpointOut, out_bytes.data(),
                              int(out_bytes.size()), on_done, &out_done, kTimeoutMs);
    if (libusb_submit_transfer(in.get()) != LIBUSB_SUCCESS) return false;
    const bool sent = libusb_submit_transfer(out.get()) == LIBUSB_SUCCESS;
    bool answered = false;
    for (int tries = 0; tries < int(kTimeoutMs); ++tries) {
      while (!in_done) libusb_handle_events_completed(context.get(), &in_done);
      answered = in->status == LIBUSB_TRANSFER_COMPLETED && read(in->actual_length);
      if (answered || in->status != LIBUSB_TRANSFER_COMPLETED) break;
      in_done = 0;
      if (libusb_submit_transfer(in.get()) != LIBUSB_SUCCESS) break;
    }
    while (sent && !out_done) libusb_handle_events_completed(context.get(), &out_done);
    return answered;
  }
};

BareExchange::BareExchange(const std::string& place, bool event_character)
    : parts_(std::make_unique<Parts>()) {
  parts_->context = usb::make_context();
  if (!parts_->context) return;
  for (const usb::BusDevice& found : usb::find(parts_->context.get(), is_falcon)) {
    if (found.address != place) continue;
    usb::ClaimedDevice opened = usb::open(found.device.get(), 0);
    if (!opened.handle || falcon::set_up(opened.handle.get()).problem != usb::UsbProblem::kNone)
      return;
    constexpr uint8_t kToDevice = 0x40, kEventCharacter = 6;
    if (!event_character)
      libusb_control_transfer(opened.handle.get(), kToDevice, kEventCharacter, 0, 0, nullptr, 0,
                              kTimeoutMs);
    parts_->handle = std::move(opened.handle);
    parts_->in.reset(libusb_alloc_transfer(0));
    parts_->out.reset(libusb_alloc_transfer(0));
  }
}

BareExchange::~BareExchange() = default;

bool BareExchange::valid() const {
  return parts_->handle && parts_->in && parts_->out;
}

bool BareExchange::exchange(Way way) {
  return way == Way::kTogether ? parts_->together() : parts_->one_after_the_other();
}

}  // namespace palpate::devices::test
