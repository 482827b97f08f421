"""UDP multicast on this machine's network: an address with the interface, packets out, and packets in."""
