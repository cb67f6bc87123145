"""Turn seed matches into candidate poses."""
