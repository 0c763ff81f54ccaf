#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "integration/devices/falcon_protocol.h"
#include "integration/devices/falcon_setup.h"
#include "integration/devices/usb.h"

namespace palpate::devices::falcon {

/// The fast link to an opened Falcon: one packet out, one in, by transfers that are made
/// beforehand. Reading is asked for before the command is sent, so that the chip's answer finds it
/// waiting.
///
/// Made, retired and destroyed by the worker; exchange() is the servo's. They agree elsewhere who
/// may use it; only cut() may be called while the other exchanges.
///
/// Real-time: our code neither allocates nor locks. libusb does inside: each transfer submitted is
/// one calloc, freed when it is done, and a few of its mutexes, which nobody else holds meanwhile.
class FalconLink {
 public:
  FalconLink(usb::ContextPtr context, usb::HandlePtr handle);
  ~FalconLink();
  FalconLink(const FalconLink&) = delete;
  FalconLink& operator=(const FalconLink&) = delete;

  /// False if there was no memory for its transfers.
  bool usable() const noexcept { return in_ && out_ && cut_; }

  struct FalconOutcome {
    bool answered = false;                             ///< newest() is new
    bool garbage = false;                              ///< bytes came that were no answer
    usb::UsbProblem problem = usb::UsbProblem::kNone;  ///< transfers do not work any more
  };

  /// Sends a command (unless the last one is still on its way) and waits until every command has
  /// its answer, `wait_ns` at most. An answer that is late is taken by the next exchange.
  ///
  /// Answers have no number, so one that nobody fetched would make every later one an exchange old.
  /// Where that may be (at the start, after an answer that was given up) the next exchange first
  /// reads until the chip says that it has nothing, and takes up to 2 wait_ns for once. One that is
  /// later still is known by coming before the command has gone out. Servo thread; real-time as
  /// said above.
  FalconOutcome exchange(const Packet& command, int64_t wait_ns) noexcept;

  const FalconAnswer& newest() const noexcept { return stream_.newest(); }
  uint64_t rejected_bytes() const noexcept { return stream_.rejected_bytes(); }

  /// Motors off, for when the servo thread no longer calls. Any thread; does not wait.
  void cut() noexcept;

  /// Takes back what is in flight, so that the handle can be used for waiting transfers or closed.
  /// Worker; the servo must not exchange. Returns after 200 ms at most.
  void retire() noexcept;

  libusb_device_handle* handle() const noexcept { return handle_.get(); }

 private:
  static void LIBUSB_CALL on_in(libusb_transfer* transfer);
  static void LIBUSB_CALL on_out(libusb_transfer* transfer);
  static void LIBUSB_CALL on_cut(libusb_transfer* transfer);
  void read_surplus(int64_t until_ns) noexcept;
  void submit_in() noexcept;
  void submit_out(const Packet& command) noexcept;
  void note(usb::UsbProblem problem) noexcept;

  // The order matters: the waiter needs the context, transfers need the handle.
  usb::ContextPtr context_;
  usb::HandlePtr handle_;
  usb::EventWaiter waiter_;
  usb::TransferPtr in_, out_, cut_;
  std::array<uint8_t, kInBytes> in_bytes_{};
  Packet out_bytes_{}, cut_bytes_{};
  bool in_flying_ = false, out_flying_ = false;
  std::atomic<bool> cut_flying_ = false;
  std::atomic<int> cuts_owed_ = 0;  ///< answers that cut() will bring

  AnswerStream stream_;
  bool unsure_ = true;    ///< the chip may hold answers to commands that are not counted any more
  bool nothing_ = false;  ///< the last read brought the chip's status alone
  int owed_ = 0;          ///< commands without an answer yet
  int answers_ = 0;       ///< since the exchange began
  usb::UsbProblem problem_ = usb::UsbProblem::kNone;  ///< the first since the exchange began
};

}  // namespace palpate::devices::falcon
