#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/host_name.hpp>
#include <boost/asio/ip/tcp.hpp>

#include "integration/web/own_addresses.h"

namespace palpate::web {

// Windows resolves the machine's own name to all of them.
std::vector<std::string> own_addresses() {
  namespace net = boost::asio;
  std::vector<std::string> found;
  boost::system::error_code failure;
  net::io_context context;
  net::ip::tcp::resolver resolver(context);
  for (const auto& one :
       resolver.resolve(net::ip::tcp::v4(), net::ip::host_name(failure), "", failure))
    if (!one.endpoint().address().is_loopback())
      found.push_back(one.endpoint().address().to_string());
  return found;
}

}  // namespace palpate::web
