#pragma once

#include <chrono>
#include <span>
#include <string>

#include "compute/volume/result.h"

namespace palpate::web {

/// A certificate that vouches for itself, with its private key. Browsers warn of it once; a person
/// compares the fingerprint.
struct Certificate {
  std::string pem, key_pem;
  std::string fingerprint;  ///< SHA-256, "AB:CD:..."
  std::chrono::system_clock::time_point expires;
};

/// Makes one for these names and addresses of this machine ("localhost", "192.168.1.7"): an
/// elliptic curve key (P-256), valid from an hour ago, so that a clock may be late, until `valid`
/// from now. Errors: kDeviceFailed, if OpenSSL has no random numbers or refuses. Any thread.
Result<Certificate> make_certificate(std::span<const std::string> names,
                                     std::chrono::seconds valid);

/// So many random bytes in hexadecimal digits; kDeviceFailed as above. Any thread.
Result<std::string> random_hex(size_t bytes);

}  // namespace palpate::web
