#include "integration/devices/falcon_link.h"
#include "module/haptics/servo/monotonic.h"

#include <algorithm>

namespace palpate::devices::falcon {

FalconLink::FalconLink(usb::ContextPtr context, usb::HandlePtr handle)
    : context_(std::move(context)),
      handle_(std::move(handle)),
      waiter_(context_.get()),
      in_(libusb_alloc_transfer(0)),
      out_(libusb_alloc_transfer(0)),
      cut_(libusb_alloc_transfer(0)),
      cut_bytes_(encode({{}, kRed, false})) {
  if (!usable()) return;
  // No time-outs by libusb: they would arm a timer at every transfer. Waiting is ours.
  libusb_fill_bulk_transfer(in_.get(), handle_.get(), kEndpointIn, in_bytes_.data(),
                            int(in_bytes_.size()), on_in, this, 0);
  libusb_fill_bulk_transfer(out_.get(), handle_.get(), kEndpointOut, out_bytes_.data(),
                            int(out_bytes_.size()), on_out, this, 0);
  libusb_fill_bulk_transfer(cut_.get(), handle_.get(), kEndpointOut, cut_bytes_.data(),
                            int(cut_bytes_.size()), on_cut, this, 0);
}

FalconLink::~FalconLink() {
  retire();
}

FalconLink::FalconOutcome FalconLink::exchange(const Packet& command, int64_t wait_ns) noexcept {
  const uint64_t rejected = rejected_bytes();
  answers_ = 0;
  problem_ = usb::UsbProblem::kNone;
  owed_ += cuts_owed_.exchange(0, std::memory_order_acq_rel);
  if (in_flying_ || out_flying_ || cut_flying_.load(std::memory_order_acquire)) waiter_.handle();
  if (unsure_ && owed_ == 0) read_surplus(monotonic_ns() + wait_ns);
  const int64_t end = monotonic_ns() + wait_ns;
  if (problem_ == usb::UsbProblem::kNone && !in_flying_) submit_in();
  if (problem_ == usb::UsbProblem::kNone && !out_flying_) submit_out(command);
  while (problem_ == usb::UsbProblem::kNone && (owed_ > 0 || out_flying_)) {
    const int64_t left = end - monotonic_ns();
    if (left <= 0) break;
    waiter_.wait(left);
  }
  // Of several owed answers one was lost, if this one came and the others did not within the wait.
  if (answers_ > 0 && owed_ > 0) {
    owed_ = 0;
    unsure_ = true;  // or it is only later than that
  }
  return {answers_ > 0, rejected_bytes() != rejected, problem_};
}

void FalconLink::read_surplus(int64_t until_ns) noexcept {
  do {
    if (!in_flying_) submit_in();
    while (problem_ == usb::UsbProblem::kNone && in_flying_) {
      const int64_t left = until_ns - monotonic_ns();
      if (left <= 0) return;
      waiter_.wait(left);
    }
  } while (problem_ == usb::UsbProblem::kNone && !nothing_);
  unsure_ = problem_ != usb::UsbProblem::kNone;
  answers_ = 0;  // they answer nothing that is asked now
}

void FalconLink::cut() noexcept {
  if (cut_flying_.exchange(true, std::memory_order_acq_rel)) return;
  if (libusb_submit_transfer(cut_.get()) == LIBUSB_SUCCESS)
    cuts_owed_.fetch_add(1, std::memory_order_acq_rel);
  else
    cut_flying_.store(false, std::memory_order_release);
}

void FalconLink::retire() noexcept {
  if (!usable()) return;
  owed_ = 0;  // so that what comes back is not asked for again
  unsure_ = true;
  if (in_flying_) libusb_cancel_transfer(in_.get());
  if (out_flying_) libusb_cancel_transfer(out_.get());
  if (cut_flying_) libusb_cancel_transfer(cut_.get());
  const int64_t end = monotonic_ns() + 200'000'000;
  while ((in_flying_ || out_flying_ || cut_flying_) && monotonic_ns() < end)
    waiter_.wait(5'000'000);
  stream_.drop_rest();
  cuts_owed_ = 0;
}

void FalconLink::submit_in() noexcept {
  const int code = libusb_submit_transfer(in_.get());
  in_flying_ = code == LIBUSB_SUCCESS;
  note(usb::problem_of(code));
}

void FalconLink::submit_out(const Packet& command) noexcept {
  out_bytes_ = command;
  const int code = libusb_submit_transfer(out_.get());
  out_flying_ = code == LIBUSB_SUCCESS;
  if (out_flying_) ++owed_;
  note(usb::problem_of(code));
}

void FalconLink::note(usb::UsbProblem problem) noexcept {
  if (problem_ == usb::UsbProblem::kNone) problem_ = problem;
}

void FalconLink::on_in(libusb_transfer* transfer) {
  auto* link = static_cast<FalconLink*>(transfer->user_data);
  link->in_flying_ = false;
  link->note(usb::problem_of(transfer->status));
  if (transfer->status != LIBUSB_TRANSFER_COMPLETED) return;
  const auto length = size_t(std::max(transfer->actual_length, 0));
  link->nothing_ = length <= kStatusBytes;
  if (length > kStatusBytes) {
    const auto bytes = std::span<const uint8_t>(link->in_bytes_).first(length);
    // A command that the chip has not taken yet can not have been answered: an answer that comes
    // before is an old one, and the command's own is still awaited.
    const int possible = std::max(0, link->owed_ - (link->out_flying_ ? 1 : 0));
    const int answers = std::min(link->stream_.read(bytes.subspan(kStatusBytes)), possible);
    link->answers_ += answers;
    link->owed_ -= answers;
  }
  if (link->owed_ > 0) link->submit_in();  // the chip had no answer yet, or not all of it
}

void FalconLink::on_out(libusb_transfer* transfer) {
  auto* link = static_cast<FalconLink*>(transfer->user_data);
  link->out_flying_ = false;
  link->note(usb::problem_of(transfer->status));
}

void FalconLink::on_cut(libusb_transfer* transfer) {
  static_cast<FalconLink*>(transfer->user_data)
      ->cut_flying_.store(false, std::memory_order_release);
}

}  // namespace palpate::devices::falcon
