// GET /settings and /health.
export interface Setting { name: string; value: unknown; default: unknown; help: string; secret: boolean; change: string | null }
export interface DiskUsage {
  pictures_bytes: number; pictures_limit_bytes: number; free_bytes: number; database_bytes: number | null;
  backups: { count: number; used_bytes: number; limit_bytes: number; newest_at: string | null } | null;
  replaced: string[];
}
export interface ServerSettings { version: string; items: Setting[]; storage: DiskUsage }
export interface Health { version: string; uptime_s: number; warnings: { reason: string; text: string; fix: string }[]; damaged: Damage[] }
export interface Damage { kind: string; file: string; note: string | null; fix: string; restorable: boolean }
// POST /restore-backup.
export interface Restoration { backup: number; database: number; made_at: string; file: string | null; lost: number }
