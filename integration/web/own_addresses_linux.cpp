#include <ifaddrs.h>
#include <netinet/in.h>

#include <boost/asio/ip/address_v4.hpp>

#include "integration/web/own_addresses.h"

namespace palpate::web {

std::vector<std::string> own_addresses() {
  std::vector<std::string> found;
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) != 0) return found;
  for (const ifaddrs* one = list; one; one = one->ifa_next) {
    if (!one->ifa_addr || one->ifa_addr->sa_family != AF_INET) continue;
    const auto* const ip = reinterpret_cast<const sockaddr_in*>(one->ifa_addr);
    const boost::asio::ip::address_v4 address(ntohl(ip->sin_addr.s_addr));
    if (!address.is_loopback()) found.push_back(address.to_string());
  }
  freeifaddrs(list);
  return found;
}

}  // namespace palpate::web
