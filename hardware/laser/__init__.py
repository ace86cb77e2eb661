"""The laser controller: New Focus TLB-6700 over its links."""
