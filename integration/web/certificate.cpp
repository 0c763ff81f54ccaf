#include "integration/web/certificate.h"

#include <fmt/format.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>

#include <array>
#include <memory>
#include <vector>

namespace palpate::web {
namespace {

constexpr long kClockMayBeLate_s = 3600;
constexpr int kSerialBits = 63;

template <auto Free>
struct Freed {
  template <class T>
  void operator()(T* object) const {
    Free(object);
  }
};
using Key = std::unique_ptr<EVP_PKEY, Freed<EVP_PKEY_free>>;
using X509Owner = std::unique_ptr<X509, Freed<X509_free>>;
using Extension = std::unique_ptr<X509_EXTENSION, Freed<X509_EXTENSION_free>>;
using BigNumber = std::unique_ptr<BIGNUM, Freed<BN_free>>;
using Memory = std::unique_ptr<BIO, Freed<BIO_free_all>>;

Error refused_by_openssl() {
  std::array<char, 256> words{};
  ERR_error_string_n(ERR_get_error(), words.data(), words.size());
  return {ErrorKind::kDeviceFailed,
          fmt::format("A certificate for the page can not be made: OpenSSL says {}", words.data())};
}

bool is_address(const std::string& name) {
  return name.find(':') != std::string::npos ||
         name.find_first_not_of("0123456789.") == std::string::npos;
}

bool add_extension(X509* certificate, int which, const std::string& words) {
  X509V3_CTX context;
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, certificate, certificate, nullptr, nullptr, 0);
  const Extension extension(X509V3_EXT_conf_nid(nullptr, &context, which, words.c_str()));
  return extension && X509_add_ext(certificate, extension.get(), -1) == 1;
}

template <class Write>
std::string written(Write write) {
  const Memory memory(BIO_new(BIO_s_mem()));
  if (!memory || write(memory.get()) != 1) return {};
  char* begin = nullptr;
  const long count = BIO_get_mem_data(memory.get(), &begin);
  return {begin, size_t(count)};
}

std::string fingerprint_of(const X509* certificate) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned count = 0;
  if (X509_digest(certificate, EVP_sha256(), digest.data(), &count) != 1) return {};
  std::string text;
  for (unsigned n = 0; n < count; ++n)
    text += fmt::format("{}{:02X}", n == 0 ? "" : ":", digest[n]);
  return text;
}

}  // namespace

Result<Certificate> make_certificate(std::span<const std::string> names,
                                     std::chrono::seconds valid) {
  const Key key(EVP_EC_gen("P-256"));
  const X509Owner certificate(X509_new());
  const BigNumber serial(BN_new());
  if (!key || !certificate || !serial ||
      BN_rand(serial.get(), kSerialBits, BN_RAND_TOP_ANY, BN_RAND_BOTTOM_ANY) != 1)
    return refused_by_openssl();

  // Who it is for, and how long.
  std::string addresses;
  for (const std::string& name : names)
    addresses +=
        fmt::format("{}{}:{}", addresses.empty() ? "" : ",", is_address(name) ? "IP" : "DNS", name);
  X509* const made = certificate.get();
  X509_NAME* const subject = X509_get_subject_name(made);
  const auto* const common_name = reinterpret_cast<const unsigned char*>("palpate");
  const bool filled =
      X509_set_version(made, X509_VERSION_3) == 1 &&
      BN_to_ASN1_INTEGER(serial.get(), X509_get_serialNumber(made)) != nullptr &&
      X509_gmtime_adj(X509_getm_notBefore(made), -kClockMayBeLate_s) != nullptr &&
      X509_gmtime_adj(X509_getm_notAfter(made), long(valid.count())) != nullptr &&
      X509_set_pubkey(made, key.get()) == 1 &&
      X509_NAME_add_entry_by_txt(subject, "CN", MBSTRING_ASC, common_name, -1, -1, 0) == 1 &&
      X509_set_issuer_name(made, subject) == 1 &&
      add_extension(made, NID_basic_constraints, "critical,CA:FALSE") &&
      add_extension(made, NID_ext_key_usage, "serverAuth") &&
      add_extension(made, NID_subject_alt_name, addresses) &&
      X509_sign(made, key.get(), EVP_sha256()) != 0;
  if (!filled) return refused_by_openssl();

  Certificate result;
  result.pem = written([&](BIO* out) { return PEM_write_bio_X509(out, made); });
  result.key_pem = written([&](BIO* out) {
    return PEM_write_bio_PrivateKey(out, key.get(), nullptr, nullptr, 0, nullptr, nullptr);
  });
  result.fingerprint = fingerprint_of(made);
  result.expires = std::chrono::system_clock::now() + valid;
  if (result.pem.empty() || result.key_pem.empty() || result.fingerprint.empty())
    return refused_by_openssl();
  return result;
}

Result<std::string> random_hex(size_t bytes) {
  std::vector<unsigned char> random(bytes);
  if (RAND_bytes(random.data(), int(bytes)) != 1) return refused_by_openssl();
  std::string text;
  for (const unsigned char byte : random) text += fmt::format("{:02x}", byte);
  return text;
}

}  // namespace palpate::web
